//! Responses and margins of a closed loop, as text.

use super::table::{figure_sentence, labelled};
use bench_experiment::outputs::LoopOutputs;
use bench_report::figures::swept_loop;

/// The files of the responses, and the measured margins.
pub(super) fn text(outputs: &LoopOutputs) -> String {
    [
        labelled("loop", &outputs.loop_csv),
        labelled("S", &outputs.sensitivity_csv),
        labelled("T", &outputs.complementary_csv),
        labelled("measured", &figure_sentence(&swept_loop(outputs))),
    ]
    .concat()
}
