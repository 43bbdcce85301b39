//! Frequency responses in closed form, with noise of known power.
use bench_identify::FrfDatum;
use bench_plant::zeros::ModalTerm;
use nalgebra::Complex;

/// Approximately normal deviates of mean 0 and variance 1: sums of twelve uniform deviates.
pub fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x1234_5678_9ABC_DEF1;
    let mut uniform = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

pub fn term(hz: f64, damping_ratio: f64, residue_per_kg: f64) -> ModalTerm {
    ModalTerm {
        omega_rad_s: std::f64::consts::TAU * hz,
        damping_ratio,
        residue_per_kg,
    }
}

/// The stage of Chapter 6 at D = +10 %, Y1o = 8 % of L, rounded.
pub fn stage() -> Vec<ModalTerm> {
    vec![
        term(29.27, 0.0088, 0.4715),
        term(82.23, 0.004, -0.0319),
        term(85.78, 0.0039, 0.0209),
    ]
}

pub fn response(modes: &[ModalTerm], hz: f64, delay_s: f64) -> Complex<f64> {
    let s = Complex::new(0.0, std::f64::consts::TAU * hz);
    let part = |t: &ModalTerm| {
        let w = t.omega_rad_s;
        (s * s + s * (2.0 * t.damping_ratio * w) + w * w).inv() * t.residue_per_kg
    };
    modes.iter().map(part).sum::<Complex<f64>>() * (-s * delay_s).exp()
}

/// 5 to 200 Hz in steps of 0.05 %. The complex noise has a standard deviation of `sigma_m_per_n`.
pub fn frf_data(modes: &[ModalTerm], delay_s: f64, sigma_m_per_n: f64, seed: u64) -> Vec<FrfDatum> {
    let mut normal = normal(seed);
    let count = (200.0f64 / 5.0).ln() / 5e-4;
    let at = |k: usize| {
        let frequency_hz = 5.0 * (5e-4 * k as f64).exp();
        let noise = Complex::new(normal(), normal()) * (sigma_m_per_n / 2f64.sqrt());
        let response = response(modes, frequency_hz, delay_s) + noise;
        FrfDatum {
            frequency_hz,
            spread_hz: 0.0,
            response,
            variance: (sigma_m_per_n * sigma_m_per_n).max(1e-30),
        }
    };
    (0..count as usize).map(at).collect()
}
