//! Every test named in `src/numerics.rs` exists.

use std::{fs, path::Path};

#[test]
fn every_test_that_the_page_names_is_in_the_file_that_it_names() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(root.join("src/numerics.rs")).unwrap();
    let (mut file, mut source, mut found) = ("", String::new(), 0);
    for quoted in page.split('`').skip(1).step_by(2) {
        if quoted.ends_with(".rs") {
            file = quoted;
            source = fs::read_to_string(root.join(file)).unwrap_or_else(|_| panic!("there is no {file}"));
        } else if quoted.matches('_').count() > 3 {
            let is_test = |text: &str| text.trim_end().ends_with("#[test]");
            let place = source.find(&format!("fn {quoted}("));
            assert!(place.is_some_and(|at| is_test(&source[..at])), "no test {quoted} in {file}");
            found += 1;
        }
    }
    assert!(found > 30, "only {found} tests are named");
}
