//! Controllers in files of other programs. `controllers/make.py` writes the valid ones.

use bench_control::{Domain, GainUnit, ImportOptions, import};

use crate::random_inputs::damage::check_damaged;

#[test]
fn damaged_file_of_another_program_is_refused_or_has_a_finite_response() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("controller");
    let options = ImportOptions {
        gain_unit: GainUnit::AmperesPerMetre,
        domain: None,
        variable: None,
    };
    let valid: [&[u8]; 6] = [
        include_bytes!("controllers/tf-compressed.mat"),
        include_bytes!("controllers/zpk.mat"),
        include_bytes!("controllers/ss-structure.mat"),
        include_bytes!("controllers/ss.npz"),
        include_bytes!("controllers/zpk-compressed.npz"),
        br#"{"C": {"z": [[-1, 2.5], [-1, -2.5]], "p": [0, [-3, 0], -4], "k": 2}, "Ts": 0}"#,
    ];
    check_damaged("import of controllers", &valid, |bytes| {
        std::fs::write(&path, bytes).expect("a file");
        let Ok(imported) = import(&path, "x", &options) else {
            return false;
        };
        let cascade = imported.cascade;
        assert!(matches!(
            cascade.domain,
            Domain::Continuous | Domain::Discrete { .. }
        ));
        assert!(cascade.agreement.difference <= 1e-6);
        let response = cascade.response(100.0);
        assert!(response.re.is_finite() && response.im.is_finite());
        true
    });
}
