//! Files of controllers.
use crate::config_settings::program::Bench;

#[test]
fn controller_files_are_checked_like_configurations() {
    let section = |body: &str| format!("title = \"x\"\n[[section]]\n{body}\n");
    let cases: &[(String, &[&str])] = &[
        (
            section("kind = \"gain\"\ngain_a_per_umm = 1"),
            &["line 4", "`section.0.gain_a_per_umm`", "`gain_a_per_um`"],
        ),
        (
            section("kind = \"gian\"\ngain_a_per_um = 1"),
            &["line 3", "\"gian\"", "gain, integrator"],
        ),
        (
            section("kind = \"gain\""),
            &["line 2", "`section.0.gain_a_per_um` is missing"],
        ),
        (
            section("kind = \"gain\"\ngain_a_per_um = true"),
            &["line 4", "true", "give a number"],
        ),
        (
            section("kind = \"gain\"\ngain_a_per_um = nan"),
            &["line 4", "NaN", "1000000000000"],
        ),
        (
            section("kind = \"pole\"\npole_rad_s = -5"),
            &["section 1", "unstable", "5.0000"],
        ),
        (
            section("kind = \"pole_pair\"\nomega_rad_s = 5\ndamping_ratio = 0"),
            &["section 1", "unstable", "5.0000j"],
        ),
        (
            section("kind = \"coefficients\"\nnumerator = [1, 0, 0]\ndenominator = [1, 1]"),
            &["section 1", "improper", "order 2", "add a pole"],
        ),
        (
            section("kind = \"coefficients\"\nnumerator = [1]\ndenominator = [0]"),
            &["section 1", "coefficients are all 0"],
        ),
        (
            section("kind = \"coefficients\"\nnumerator = [1,2,3,4]\ndenominator = [1]"),
            &["has 4 entries", "1 to 3"],
        ),
        (
            section(
                "kind = \"biquad\"\nzeros_rad_s = 1\nzeros_damping_ratio = 1\npoles_rad_s = 1\npoles_damping_ratio = 1\nprewarp_rad_s = 20000",
            ),
            &["section 1", "20000 rad/s", "15708.0 rad/s"],
        ),
        (
            "title = \"x\"\nsection = []\n".into(),
            &["line 2", "`section` has 0 entries", "1 to 32"],
        ),
        (
            "title = \"x\"\n".into(),
            &["own.toml: `section` is missing"],
        ),
        (
            String::new(),
            &["own.toml: `title` is missing", "`section` is missing"],
        ),
        ("title = [\n".into(), &["own.toml", "line 1, column 10"]),
    ];
    for (text, words) in cases {
        let bench = Bench::new();
        bench.write("own.toml", text);
        for command in ["margins", "control"] {
            bench
                .run(&format!("{command} --controller own.toml --json"))
                .is_refused(&[words, &["own.toml"][..]].concat());
        }
        assert_eq!(bench.files(), ["own.toml"], "{text}");
    }
    Bench::new()
        .run("margins --controller nosuch")
        .is_refused(&["nosuch", "fast, slow"]);
}
