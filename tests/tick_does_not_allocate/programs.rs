//! Programs of every kind, each with a duration of about 1 s.
use bench_config::{AmplitudePoint, Config, ExcitationKind, ReferenceSettings, Sweep, TravelPoint};
use bench_control::ControllerText;
use bench_excitation::command::{CommandFilter, FilteredCommand, Taps};
use bench_excitation::{
    Chirp, FileReference, HoldReference, RampReference, ReferenceContext, SineReference,
    StepReference, SweptReference, ZeroCurrent,
};
use bench_rt::program::{Control, Excite, Program};

/// Name of the program that commands zero current.
pub const NO_CURRENT: &str = "no current";

/// A program of every kind, with its name.
pub fn programs(config: &Config) -> Vec<(String, Box<dyn Program>)> {
    let period_s = config.servo.period_s();
    let references = [
        ReferenceSettings::Hold(HoldReference {}),
        ReferenceSettings::Step(StepReference {
            amplitude_m: 50e-6,
            at_s: 0.1,
        }),
        ReferenceSettings::Ramp(RampReference {
            amplitude_m: 50e-6,
            speed_m_per_s: 1e-4,
            at_s: 0.1,
        }),
        ReferenceSettings::Sine(SineReference {
            amplitude_m: 20e-6,
            frequency_hz: 3.0,
        }),
        ReferenceSettings::Chirp(SweptReference {
            amplitude: vec![TravelPoint {
                frequency_hz: 1.0,
                amplitude_m: 1e-6,
            }],
            travel_m: 20e-6,
        }),
        ReferenceSettings::File(FileReference {
            path: "points.csv".into(),
        }),
    ];
    let mut programs: Vec<(String, Box<dyn Program>)> = Vec::new();
    for controller in controllers() {
        let name = &controller.name;
        let design = controller.design(config.servo.rate_hz).expect("valid");
        for settings in &references {
            let points = "time_s,reference_m\n0.0,0.0\n0.2,1e-5\n0.4,2e-5\n";
            let context = ReferenceContext {
                chirp: &config.chirp,
                period_s,
                file: Some(points),
            };
            let reference = settings.design().build(&context).expect("valid");
            let program = Control::new(design.law(period_s), reference, 500, 4500);
            programs.push((format!("{name}, {settings:?}"), Box::new(program)));
            let reference = settings.design().build(&context).expect("valid");
            let command = FilteredCommand::new(reference, filter());
            let command = Box::new(command);
            let program = Control::with_command(design.law(period_s), command, 500, 4500);
            programs.push((format!("{name}, filtered {settings:?}"), Box::new(program)));
        }
    }
    for sweep in [Sweep::Linear, Sweep::Logarithmic] {
        let mut chirp = config.chirp.clone();
        (
            chirp.sweep,
            chirp.duration_s,
            chirp.quiet_before_s,
            chirp.quiet_after_s,
        ) = (sweep, 0.8, 0.1, 0.1);
        (chirp.fade_in_s, chirp.amplitude) = (
            0.2,
            vec![AmplitudePoint {
                frequency_hz: 1.0,
                current_a: 0.2,
            }],
        );
        programs.push((
            format!("{sweep:?} chirp"),
            Box::new(Excite(Chirp::new(&chirp, period_s))),
        ));
    }
    for &kind in ExcitationKind::ALL {
        programs.push((
            format!("{kind:?} from its settings"),
            Box::new(Excite(
                short(config, kind)
                    .chosen_excitation()
                    .expect("settings")
                    .build(),
            )),
        ));
    }
    let mut campaign = config.campaign.clone();
    (campaign.settle_s, campaign.average_s) = (0.5, 0.5);
    programs.push((
        NO_CURRENT.into(),
        Box::new(Excite(ZeroCurrent::new(
            campaign.settle_s,
            campaign.average_s,
            period_s,
        ))),
    ));
    programs
}

/// A controller of every form and kind.
fn controllers() -> Vec<ControllerText> {
    let own = "title = 'own'\n[[section]]\nkind = 'integrator'\ngain_a_per_um = 0.05\n[[section]]\nkind = 'coefficients'\n\
               numerator = [1.0, 2.0, 90000.0]\ndenominator = [1.0, 400.0, 90000.0]\nprewarp_rad_s = 300.0\n";
    let transfer = "title = 'transfer'\n[tf]\nnumerator = [0.05]\ndenominator = [1.0, 0.0]\ngain_unit = 'A/um'\n";
    let matrices = "title = 'matrices'\n[law]\nkind = 'state_space'\nrate_hz = 5000.0\na = [[0.5]]\nb_reference = [1.0]\n\
                    b_position = [-1.0]\nc = [1.0]\n";
    let repetitive = "title = 'repetitive'\n[law]\nkind = 'repetitive'\nperiod_ticks = 1000\nlead_ticks = 5\nlearning_gain = 0.1\n\
                      forgetting = 0.9\n[[law.section]]\nkind = 'integrator'\ngain_a_per_um = 0.05\n";
    let texts = [own, transfer, matrices, repetitive];
    let written = texts.iter().map(|text| ControllerText {
        name: text.lines().next().unwrap_or_default().into(),
        text: (*text).into(),
    });
    let embedded = ["fast", "slow"].map(|name| ControllerText::find(name).expect("found"));
    embedded.into_iter().chain(written).collect()
}

/// A shaped reference and a feedforward current, with delays and preview; 1 A for 100 um.
fn filter() -> CommandFilter {
    let reference = Taps::dense(-50, vec![0.01; 100]);
    let feedforward = Taps::dense(-80, vec![62.5; 160]);
    CommandFilter::new(reference, feedforward).expect("finite")
}

/// Settings for an excitation of almost 1 s; the chirp has two repetitions.
fn short(config: &Config, kind: ExcitationKind) -> Config {
    let mut config = config.clone();
    config.excitation.kind = kind;
    let chirp = &mut config.chirp;
    (
        chirp.start_hz,
        chirp.stop_hz,
        chirp.duration_s,
        chirp.repetitions,
    ) = (50.0, 150.0, 0.4, 2);
    (
        chirp.quiet_before_s,
        chirp.quiet_after_s,
        chirp.fade_in_s,
        chirp.fade_out_s,
    ) = (0.02, 0.02, 0.05, 0.05);
    chirp.amplitude = vec![AmplitudePoint {
        frequency_hz: 1.0,
        current_a: 0.2,
    }];
    let (multisine, prbs, sines) = (
        &mut config.excitations.multisine,
        &mut config.excitations.prbs,
        &mut config.excitations.stepped_sine,
    );
    (multisine.period_s, multisine.periods) = (0.1, 7);
    (
        prbs.order,
        prbs.clock_divider,
        prbs.periods,
        prbs.settle_periods,
    ) = (8, 2, 7, 1);
    (sines.count, sines.settle_s, sines.measure_s) = (3, 0.12, 0.12);
    config
}
