//! Every case of abuse, for every strand model.

use pelage_sim::Model;
use pelage_sim::stress::{CASES, Measures};

fn run(model: Model) {
    let mut broken = Vec::new();
    for case in CASES {
        let Measures { all, .. } = case.once(model);
        for m in &all {
            println!("{model:?} {:22} {:48} {:12.3e} <= {:9.3e} {}", case.name, m.what, m.value, m.bound, m.holds());
        }
        broken.extend(all.into_iter().filter(|m| !m.holds()).map(|m| format!("{}: {m:?}", case.name)));
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn rods_stay_hair() {
    run(Model::Rod);
}

#[test]
fn springs_stay_hair() {
    run(Model::Springs);
}
