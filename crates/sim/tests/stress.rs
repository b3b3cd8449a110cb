//! Every case of abuse, for every strand model: `cargo test -p pelage-sim --test stress springs::storm` runs one.

use pelage_sim::Model;
use pelage_sim::stress::{CASES, Measures};

fn run(model: Model, name: &str) {
    let name = name.replace('_', "-");
    let case = CASES.iter().find(|c| c.name == name).expect("a case of this name");
    // Of contact, what one strand leaves for the next in a thread's buffers shows on several threads only.
    let Measures { all, .. } = if name == "shaken-body" { case.measure(model) } else { case.once(model) };
    for m in &all {
        println!("{model:?} {name:22} {:48} {:12.3e} <= {:9.3e} {}", m.what, m.value, m.bound, m.holds());
    }
    let broken: Vec<_> = all.into_iter().filter(|m| !m.holds()).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

macro_rules! cases {
    ($($model:ident of $which:ident: $($name:ident)*;)*) => {
        $(mod $model {
            $(#[test]
            fn $name() {
                super::run(pelage_sim::Model::$which, stringify!($name));
            })*
        })*

        #[test]
        fn none_is_forgotten() {
            let listed = [$((Model::$which, &[$(stringify!($name)),*][..])),*];
            for case in CASES {
                for model in case.models {
                    let here = listed.iter().any(|(of, all)| of == model && all.contains(&&*case.name.replace('-', "_")));
                    assert!(here, "{} of {model:?}", case.name);
                }
            }
        }
    };
}

cases! {
    rods of Rod: violent_skin long_steps short_steps teleport stiffness masses air one_segment no_length colinear
        two_thousand_segments crushed inverted born_inside flat_body shaken_body thorns storm gravity standing
        root_no_number input_no_number span_no_number skin_no_number denormals;
    springs of Springs: violent_skin long_steps short_steps teleport stiffness masses air one_segment no_length colinear
        two_thousand_segments crushed inverted born_inside flat_body shaken_body thorns storm gravity standing
        root_no_number input_no_number span_no_number skin_no_number denormals;
    paper of Paper: nine_steps;
}
