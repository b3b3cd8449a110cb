//! Broken motion tables.

use super::Corpus;

const MOTION: &str = "grooms/ball.csv";
const HEAD: &str = "time_s,tx,ty,tz,qx,qy,qz,qw\n";

#[test]
fn motions_that_are_broken() {
    let mut corpus = Corpus::new();
    let row = "0,0,0,0,0,0,0,1\n";
    let cases: [(&str, String, &str); 14] = [
        ("empty", String::new(), "no lines"),
        ("comments only", "# nothing\n".into(), "no lines"),
        ("header only", HEAD.into(), "no samples"),
        ("no header", row.into(), "line 1|no column|help:"),
        ("a column short", format!("time_s,tx,ty,tz,qx,qy,qz\n{row}"), "line 1|no column 'qw'|help:"),
        ("a column twice", format!("time_s,tx,tx,tz,qx,qy,qz,qw\n{row}"), "line 1|twice|help:"),
        ("a value short", format!("{HEAD}{row}1,0,0,0,0,0,1\n"), "line 3|7 values"),
        ("text", format!("{HEAD}{row}1,0,left,0,0,0,0,1\n"), "line 3|ty|'left'"),
        ("a comma for the point", format!("{HEAD}{row}1,0,\"0,5\",0,0,0,0,1\n"), "line 3|9 values"),
        ("not finite", format!("{HEAD}{row}1,0,0,nan,0,0,0,1\n"), "line 3|tz|finite"),
        ("not a rotation", format!("{HEAD}{row}1,0,0,0,0,0.5,0,1\n"), "line 3|length 1|help:"),
        ("a zero rotation", format!("{HEAD}{row}1,0,0,0,0,0,0,0\n"), "line 3|length 1|help:"),
        ("times that stand still", format!("{HEAD}{row}{row}"), "line 3|time_s|help:"),
        ("times that fall", format!("{HEAD}{row}1,0,0,0,0,0,0,1\n0.5,0,0,0,0,0,0,1\n"), "line 4|0.5|help:"),
    ];
    for (case, broken, words) in cases {
        corpus.refuse(case, MOTION, broken, &format!("ball.csv|{words}"));
    }
    corpus.refuse("not text", MOTION, b"time_s,tx\xff\xfe\n", "ball.csv|UTF-8|help:");
    corpus.refuse_edit("pipeline.toml", "ball.csv", "gone.csv", "pipeline.toml|skin.motion|gone.csv|help:");
    corpus.refuse_edit("pipeline.toml", "ball.csv", "", "pipeline.toml|skin.motion|not a file");
    let far = format!("{HEAD}0,1e308,0,0,0,0,0,1\n1,-1e308,0,0,0,0,0,1\n");
    corpus.refuse("beyond all measure", MOTION, far, "pipeline.toml, line|skin.motion|ball.csv|help:");
    corpus.finish();
}
