//! Transfer functions that are refused, each with its place and the remedy.

use crate::controllers::program::Bench;

fn refused(text: &str, words: &[&str]) {
    let bench = Bench::new();
    bench.write("own.toml", format!("title = \"x\"\n{text}\n"));
    for command in ["margins", "control"] {
        let answer = bench.run(&format!("{command} --controller own.toml --json"));
        answer.is_refused(&[words, &["own.toml", "; "][..]].concat());
    }
    assert_eq!(bench.files(), ["own.toml"], "{text}");
}

fn tf(body: &str) -> String {
    format!("[tf]\ngain_unit = \"A/um\"\n{body}")
}

fn zpk(body: &str) -> String {
    format!("[zpk]\ngain_unit = \"A/m\"\n{body}")
}

fn ss(body: &str) -> String {
    format!("[ss]\ngain_unit = \"A/m\"\n{body}")
}

#[test]
fn rejects_missing_and_wrong_keys() {
    refused(
        "[tf]\nnumerator = [1]\ndenominator = [1, 1]",
        &["`tf.gain_unit` is missing"],
    );
    refused(
        "[tf]\ngain_unit = \"A/nm\"\nnumerator = [1]\ndenominator = [1, 1]",
        &["line 3", "A/um, A/m"],
    );
    refused(
        &tf("numerator = []\ndenominator = [1, 1]"),
        &["line 4", "has 0 entries"],
    );
    refused(
        &tf("numerator = [1]\ndenominator = [1, nan]"),
        &["line 5", "`tf.denominator.1`", "finite"],
    );
    refused(
        &tf("numerator = [1]\ndenominator = [1, 1]\nrate = 5000"),
        &["line 6", "`rate_hz`"],
    );
    refused(
        &tf("numerator = [1]\ndenominator = [1, 1]\nrate_hz = 0"),
        &["line 6", "100000"],
    );
    refused(
        &zpk("zeros = [[1]]\npoles = [[-1, 0]]\ngain = 1"),
        &["line 4", "`zpk.zeros.0` has 1 entries"],
    );
    refused(
        &zpk("poles = [[-1, 0]]\ngain = inf"),
        &["line 5", "`zpk.gain`"],
    );
    refused(
        &format!(
            "{}\n{}",
            tf("numerator = [1]\ndenominator = [1, 1]"),
            zpk("gain = 1")
        ),
        &["`zpk` is not a setting"],
    );
}

#[test]
fn rejects_improper_and_empty_transfer_functions() {
    refused(
        &tf("numerator = [1, 0, 0]\ndenominator = [1, 1]"),
        &["improper", "2 zeros and 1 poles", "add poles"],
    );
    refused(
        &tf("numerator = [0, 0]\ndenominator = [1, 1]"),
        &["`tf.numerator`", "other than 0"],
    );
    refused(
        &tf("numerator = [1]\ndenominator = [0]"),
        &["`tf.denominator`", "other than 0"],
    );
    refused(&zpk("zeros = [[-1, 0]]\ngain = 1"), &["improper"]);
    refused(&zpk("poles = [[-1, 0]]\ngain = 0"), &["response is 0"]);
    refused(&ss("a = [[-1]]\nb = [1]\nc = [0]"), &["response is 0"]);
}

#[test]
fn rejects_complex_roots_without_conjugates() {
    refused(
        &zpk("poles = [[-1, 2]]\ngain = 1"),
        &["`zpk.poles`", "-1 +2j", "[-1, -2]"],
    );
    refused(
        &zpk("zeros = [[-1, -3]]\npoles = [[-1, 2], [-1, -2]]\ngain = 1"),
        &["`zpk.zeros`", "[-1, 3]"],
    );
}

#[test]
fn rejects_matrices_of_wrong_size() {
    refused(
        &ss("a = [[-1, 0], [0]]\nb = [1, 1]\nc = [1, 1]"),
        &["`ss.a` has 1 numbers", "2 rows"],
    );
    refused(
        &ss("a = [[-1]]\nb = [1, 1]\nc = [1]"),
        &["`ss.b` has 2 numbers"],
    );
    refused(
        &ss("a = [[-1]]\nb = [1]\nc = []"),
        &["`ss.c` has 0 numbers"],
    );
}

#[test]
fn rejects_unstable_poles_and_a_third_integrator() {
    refused(
        &tf("numerator = [1]\ndenominator = [1, -5]"),
        &["unstable", "s = 5.0000", "rate_hz"],
    );
    refused(
        &tf("numerator = [1]\ndenominator = [1, 0, 0, 0]"),
        &["3 integrators", "limit is 2"],
    );
    refused(
        &tf("numerator = [1]\ndenominator = [1, 0, 25]"),
        &["unstable", "5.0000j"],
    );
    let discrete = "rate_hz = 5000\n";
    refused(
        &zpk(&format!(
            "{discrete}poles = [[1, 0], [1, 0], [1, 0]]\ngain = 1"
        )),
        &["3 integrators", "z = 1"],
    );
    refused(
        &tf(&format!("{discrete}numerator = [1]\ndenominator = [1, 1]")),
        &["unstable", "z = -1.0"],
    );
    // A continuous controller with a sampling rate by mistake.
    refused(
        &zpk(&format!("{discrete}poles = [[-50, 0]]\ngain = 1")),
        &["z = -50", "leave out `rate_hz`"],
    );
    refused(
        &ss("a = [[0, 25], [-1, 0]]\nb = [0, 1]\nc = [1, 0]"),
        &["unstable", "5.0000j"],
    );
}

#[test]
fn rejects_another_servo_rate() {
    let text = tf("rate_hz = 1000\nnumerator = [1e-3]\ndenominator = [1, -0.5]");
    refused(
        &text,
        &[
            "`tf`",
            "1000 Hz",
            "5000 Hz (loop.rate_hz)",
            "set loop.rate_hz=1000",
        ],
    );
}

#[test]
fn rejects_a_transfer_function_that_rounding_defines_too_badly() {
    // Twelve poles at z = 0.99...: the coefficients, up to 924, define the response at low frequency to 1e-16 * 2^12/0.01^12, which is
    // no digit. The product of the printed coefficients has poles outside of the unit circle, or a response that is not reproducible.
    let mut falling = vec![0.0; 13];
    falling[0] = 1.0;
    for order in 1..=12 {
        for i in (1..=order).rev() {
            falling[i] -= 0.99 * falling[i - 1];
        }
    }
    let text = tf(&format!(
        "rate_hz = 5000\nnumerator = [1]\ndenominator = {falling:?}"
    ));
    refused(&text, &["`tf`", "z = "]);
}
