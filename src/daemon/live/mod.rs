//! What the daemon shows while the loop runs: samples, state, events and counters, decimated outside the loop.
