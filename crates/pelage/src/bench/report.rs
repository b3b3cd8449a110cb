//! The report: HTML that needs no other file, and the same as JSON and CSV.

use super::{Findings, Section, Study, machine};
use crate::Error;
use crate::files::write_whole;
use base64::Engine;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

/// Writes `report.html`, `report.json` and `points.csv`, and each plot as a file, `STUDY-TITLE.svg`.
pub(super) fn write(found: &[(Study, Findings)], folder: &Path, quick: bool) -> Result<(), Error> {
    let facts = machine::facts();
    let files = [
        ("report.html", html(found, folder, quick, &facts)),
        ("report.json", json(found, quick, &facts)),
        ("points.csv", csv(found)),
    ];
    for (name, text) in files {
        let path = folder.join(name);
        write_whole(&path, |f| f.write_all(text.as_bytes())).map_err(Error::disk(&path))?;
    }
    for (study, findings) in found {
        for svg in findings.sections.iter().flat_map(|s| &s.plots).filter(|svg| !svg.is_empty()) {
            let path = folder.join(plot_file(study.name, svg));
            write_whole(&path, |f| f.write_all(svg.as_bytes())).map_err(Error::disk(&path))?;
        }
    }
    Ok(())
}

/// Name of a plot's file: study and title, words in small letters.
fn plot_file(study: &str, svg: &str) -> String {
    let title = svg.split_once("<title>").and_then(|(_, rest)| rest.split_once("</title>")).map_or("", |(t, _)| t);
    let small = title.to_lowercase();
    let words: Vec<&str> = small.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
    format!("{study}-{}.svg", words.join("-"))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A number with four digits that count.
fn number(v: f64) -> String {
    match v.abs() {
        _ if v.is_nan() => "-".to_owned(),
        a if a == 0.0 || ((1000.0..1e7).contains(&a) && v.fract() == 0.0) => format!("{v}"),
        a if (1e-3..1e6).contains(&a) => {
            let digits = (3 - libm::floor(libm::log10(a)) as i32).clamp(0, 6) as usize;
            let text = format!("{v:.digits$}");
            if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
        }
        _ => format!("{v:.2e}"),
    }
}

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#222}\
    h1,h2,h3{line-height:1.2}h2{border-top:2px solid #ccc;padding-top:1rem;margin-top:3rem}\
    table{border-collapse:collapse;font-size:13px;margin:1rem 0}th,td{padding:2px 10px;text-align:right;\
    border-bottom:1px solid #e4e4e4}th:first-child,td:first-child{text-align:left;font-family:monospace}\
    thead th{position:sticky;top:0;background:#f4f4f4}svg{max-width:46rem;display:block;margin:1rem 0}\
    img{max-width:100%;display:block}figure{margin:1rem 0}figcaption{color:#555}code{background:#f2f2f2;padding:0 3px}\
    details{margin:1rem 0}";

fn html(found: &[(Study, Findings)], folder: &Path, quick: bool, facts: &Value) -> String {
    let mut o = String::new();
    let title = if quick { "Error against run time (quick)" } else { "Error against run time" };
    let _ = writeln!(
        o,
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Pelage: {title}</title><style>{STYLE}</style>\
         <h1>{title}</h1>"
    );
    let list: Vec<String> = found.iter().map(|(s, _)| format!("<a href=\"#{0}\">{0}</a>", s.name)).collect();
    let _ = writeln!(o, "<p>Studies: {}.</p><h3>In short</h3><ul>", list.join(", "));
    for (study, findings) in found {
        for answer in &findings.answers {
            let _ = writeln!(o, "<li><a href=\"#{0}\">{0}</a>: {1}</li>", study.name, escaped(answer));
        }
    }
    let flag = if quick { " --quick" } else { "" };
    let _ = writeln!(
        o,
        "</ul><p>A row is measured again by <code>pelage bench{flag} --point STUDY/ROW</code>; rows are also in \
         <code>points.csv</code> and <code>report.json</code> beside this file.</p><table><tbody>"
    );
    for (name, value) in facts.as_object().into_iter().flatten() {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let _ = writeln!(o, "<tr><th>{name}</th><td>{}</td></tr>", escaped(&value));
    }
    o += "</tbody></table><details><summary>Settings that stand where a row does not name them</summary><pre>";
    let _ = writeln!(o, "{}</pre></details>", escaped(&settings()));
    for (study, findings) in found {
        let _ = writeln!(o, "<h2 id=\"{0}\">{0}</h2><p>{1}</p>", study.name, escaped(study.about));
        for answer in &findings.answers {
            let _ = writeln!(o, "<p><b>{}</b></p>", escaped(answer));
        }
        findings.sections.iter().for_each(|s| section(&mut o, study.name, s, folder));
    }
    o + "</html>\n"
}

/// Defaults of everything with a knob.
fn settings() -> String {
    let (sim, shadow) = (pelage_sim::Settings::default(), pelage_light::shadow::ShadowSettings::default());
    format!("simulation: {sim:#?}\nshadow: {shadow:#?}\n")
}

fn section(o: &mut String, study: &str, s: &Section, folder: &Path) {
    let _ = writeln!(o, "<h3>{}</h3>", escaped(&s.title));
    for text in &s.text {
        let _ = writeln!(o, "<p>{}</p>", escaped(text));
    }
    s.plots.iter().for_each(|p| o.push_str(p));
    for (file, caption) in &s.pictures {
        let bytes = std::fs::read(folder.join(file)).unwrap_or_default();
        let data = base64::engine::general_purpose::STANDARD.encode(bytes);
        let caption = escaped(caption);
        let _ = writeln!(
            o,
            "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>"
        );
    }
    if s.rows.is_empty() {
        return;
    }
    let head: String = s.columns.iter().map(|c| format!("<th>{}</th>", escaped(c))).collect();
    let _ = writeln!(o, "<table><thead><tr><th>{study}/</th>{head}</tr></thead><tbody>");
    for (point, values) in &s.rows {
        let cells: String = values.iter().map(|v| format!("<td>{}</td>", number(*v))).collect();
        let _ = writeln!(o, "<tr><td>{}</td>{cells}</tr>", escaped(point));
    }
    o.push_str("</tbody></table>\n");
}

fn json(found: &[(Study, Findings)], quick: bool, facts: &Value) -> String {
    let section = |s: &Section| {
        let rows: Vec<Value> =
            s.rows.iter().map(|(point, values)| json!({ "point": point, "values": values })).collect();
        json!({ "title": s.title, "text": s.text, "columns": s.columns, "rows": rows })
    };
    let study = |(s, f): &(Study, Findings)| {
        let sections: Vec<Value> = f.sections.iter().map(section).collect();
        json!({ "name": s.name, "about": s.about, "answers": f.answers, "sections": sections })
    };
    let studies: Vec<Value> = found.iter().map(study).collect();
    let all = json!({ "quick": quick, "machine": facts, "settings": settings(), "studies": studies });
    serde_json::to_string_pretty(&all).expect("plain JSON") + "\n"
}

/// One number a line: studies have columns of their own.
fn csv(found: &[(Study, Findings)]) -> String {
    let mut out = String::from("study,section,point,quantity,value\n");
    let quoted = |t: &str| format!("\"{}\"", t.replace('"', "\"\""));
    for (study, findings) in found {
        for s in &findings.sections {
            for (point, values) in &s.rows {
                for (column, value) in s.columns.iter().zip(values) {
                    let value = if value.is_nan() { String::new() } else { format!("{value:e}") };
                    let _ = writeln!(
                        out,
                        "{},{},{},{},{value}",
                        study.name,
                        quoted(&s.title),
                        quoted(point),
                        quoted(column)
                    );
                }
            }
        }
    }
    out
}
