//! `etendue selftest`: the table, the object, exit codes.

use std::path::Path;

use serde_json::Value as Json;

use crate::support::*;

#[test]
fn device_passes_its_tests() {
    if !has_device() {
        return;
    }
    let output = etendue("selftest --json", Path::new("."));
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}{}",
        stdout(&output),
        stderr(&output)
    );
    let json: Json = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(json["failed"], 0);
    let checks = json["checks"].as_array().unwrap();
    for check in checks {
        println!("{}: {}", check["name"], check["measured"]);
    }
    let of = |group: &str| checks.iter().filter(|c| c["group"] == group).count();
    // Two more of rays for each backend, and one for their agreement.
    assert_eq!((of("numbers"), of("physics")), (12, 7));
    let backends = 2 - json["not_tested"].as_array().unwrap().len();
    assert_eq!(of("rays"), [0, 2, 5][backends]);
}

#[test]
fn devices_that_are_not_there_cannot_be_tested() {
    let output = etendue("selftest --device nonesuch", Path::new("."));
    assert_eq!(output.status.code(), Some(4));
    assert!(output.stdout.is_empty());
}
