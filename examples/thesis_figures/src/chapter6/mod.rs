//! Chapter 6: two strategies of setting the bandwidth, on simple plants and on the stage that was built.

mod loops;
mod simple;
mod stage;

pub(crate) use simple::{fig_6_2, fig_6_3, fig_6_4, fig_6_5, fig_6_6};
pub(crate) use stage::{fig_6_7, fig_6_8, fig_6_9, fig_6_10, fig_6_11, fig_6_12, fig_6_13};
