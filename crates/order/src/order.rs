//! The order: one command with its options.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::ser::Error as _;
use serde::{Deserialize, Serialize, Serializer};
use serde_json::{Map, Value};

use super::bench_options::BenchOptions;
use super::calibrate::CalibrateOrder;
use super::campaign::CampaignOrder;
use super::chirp::ChirpOrder;
use super::control::ControlOrder;
use super::identify::IdentifyOrder;
use super::linearity::LinearityOrder;
use super::rig_options::RigOptions;
use super::words::words_of;

/// Declares the commands that may be ordered: `/// what it does`, `Command(options) = "name on the command line"`.
macro_rules! commands {
    ($(#[doc = $text:literal] $command:ident($options:ty) = $name:literal,)*) => {
        /// Commands that may be ordered.
        #[derive(
            Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
        )]
        pub enum Command {
            $(
                #[doc = $text]
                #[serde(rename = $name)]
                $command,
            )*
        }

        impl Command {
            /// All commands.
            pub const ALL: &[Command] = &[$(Command::$command,)*];

            /// The name on the command line.
            pub fn name(self) -> &'static str {
                match self {
                    $(Command::$command => $name,)*
                }
            }

            /// What it does.
            pub(crate) fn description(self) -> &'static str {
                match self {
                    $(Command::$command => $text.trim_ascii(),)*
                }
            }

            /// The schema of its options, as an object.
            pub(crate) fn options_schema(self, generator: &mut SchemaGenerator) -> Schema {
                match self {
                    $(Command::$command => <$options>::json_schema(generator),)*
                }
            }
        }

        /// A command with its options: what a command line fills, what a client of the daemon sends, and what its queue holds.
        ///
        /// As JSON it is one object: `command`, and each option by its name on the command line with `_` for `-`. Quantities are
        /// texts as typed (`"0.1A"`), switches are `true`, an option that may be repeated is a list.
        ///
        /// ```
        /// use bench_order::Order;
        ///
        /// let json = r#"{"command":"control","slow":true,"duration":"2s","set":["loop.rate_hz=5000"]}"#;
        /// let order: Order = serde_json::from_str(json)?;
        /// assert_eq!(order.arguments(), ["--set=loop.rate_hz=5000", "--slow", "--duration=2s"]);
        /// let error = serde_json::from_str::<Order>(r#"{"command":"chirp","duration":"2m"}"#).unwrap_err();
        /// assert!(error.to_string().contains("give a time in s, such as 20s"));
        /// # Ok::<(), serde_json::Error>(())
        /// ```
        #[derive(Clone, Debug, PartialEq)]
        pub enum Order {
            $(
                #[doc = $text]
                $command($options),
            )*
        }

        impl Order {
            /// The command.
            pub fn command(&self) -> Command {
                match self {
                    $(Order::$command(_) => Command::$command,)*
                }
            }

            /// The options by their names in JSON.
            fn options(&self) -> Result<Value, serde_json::Error> {
                match self {
                    $(Order::$command(options) => serde_json::to_value(options),)*
                }
            }
        }
    };
}

commands! {
    /// Excite the stage and estimate its frequency response.
    Chirp(ChirpOrder) = "chirp",
    /// Run the closed loop with a reference.
    Control(Box<ControlOrder>) = "control",
    /// Measure scale, sign and offset of amplifier and probe.
    Calibrate(CalibrateOrder) = "calibrate",
    /// Excite the stage at several amplitudes.
    Linearity(LinearityOrder) = "linearity",
    /// A chirp at each point of a grid.
    Campaign(CampaignOrder) = "campaign",
    /// Analyse a recording, without motion.
    Identify(IdentifyOrder) = "identify",
}

impl Order {
    /// The options of the bench; an analysis takes its bench from the recording.
    pub fn bench(&self) -> Option<&BenchOptions> {
        match self {
            Order::Chirp(order) => Some(&order.bench),
            Order::Control(order) => Some(&order.bench),
            Order::Calibrate(order) => Some(&order.bench),
            Order::Linearity(order) => Some(&order.bench),
            Order::Campaign(order) => Some(&order.bench),
            Order::Identify(_) => None,
        }
    }

    /// The options of the rig, for a command that makes runs as ordered. A campaign makes its own; an analysis has none.
    pub fn rig(&self) -> Option<&RigOptions> {
        match self {
            Order::Chirp(order) => Some(&order.rig),
            Order::Control(order) => Some(&order.rig),
            Order::Calibrate(order) => Some(&order.rig),
            Order::Linearity(order) => Some(&order.rig),
            Order::Campaign(_) | Order::Identify(_) => None,
        }
    }

    fn bench_mut(&mut self) -> Option<&mut BenchOptions> {
        match self {
            Order::Chirp(order) => Some(&mut order.bench),
            Order::Control(order) => Some(&mut order.bench),
            Order::Calibrate(order) => Some(&mut order.bench),
            Order::Linearity(order) => Some(&mut order.bench),
            Order::Campaign(order) => Some(&mut order.bench),
            Order::Identify(_) => None,
        }
    }

    /// The same order on the bench `config` with `sets`, unless it names another bench itself. Its own settings apply over `sets`.
    pub fn on_bench(mut self, config: Option<&str>, sets: &[String]) -> Order {
        if let Some(bench) = self.bench_mut()
            && bench.config.is_none()
        {
            bench.config = config.map(String::from);
            bench.sets.splice(0..0, sets.iter().cloned());
        }
        self
    }

    /// The same order, whose result is printed as JSON.
    pub fn with_json(mut self) -> Order {
        match &mut self {
            Order::Identify(order) => order.json = true,
            other => {
                if let Some(bench) = other.bench_mut() {
                    bench.json = true;
                }
            }
        }
        self
    }

    /// The files that the order names, and what may be a file in its settings.
    pub fn files(&self) -> Vec<String> {
        let mut files = self.bench().map_or(Vec::new(), BenchOptions::files);
        match self {
            Order::Chirp(order) => files.extend(order.band.file()),
            Order::Linearity(order) => files.extend(order.band.file()),
            Order::Control(order) => files.extend(order.files()),
            Order::Calibrate(order) => {
                let file = order.write.iter();
                files.extend(file.map(|file| file.to_string_lossy().into_owned()));
            }
            Order::Identify(order) => {
                let file = order.file();
                files.extend(file.map(|file| file.to_string_lossy().into_owned()));
            }
            Order::Campaign(_) => {}
        }
        files
    }

    /// The arguments of the command line after the name of the command. Parsed, they are the same order.
    pub fn arguments(&self) -> Vec<String> {
        // The types of all options have a JSON form.
        let fields = self.fields().unwrap_or_default();
        words_of(&fields)
    }

    /// The options that are given, by their names in JSON.
    fn fields(&self) -> Result<Map<String, Value>, serde_json::Error> {
        let Value::Object(mut fields) = self.options()? else {
            return Ok(Map::new());
        };
        fields.retain(|_, value| is_given(value));
        Ok(fields)
    }
}

/// Whether the value of an option is not that of an absent one.
fn is_given(value: &Value) -> bool {
    match value {
        Value::Null | Value::Bool(false) => false,
        Value::Array(values) => !values.is_empty(),
        Value::Bool(true) | Value::Number(_) | Value::String(_) | Value::Object(_) => true,
    }
}

impl Serialize for Order {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = Map::new();
        object.insert("command".into(), self.command().name().into());
        object.extend(self.fields().map_err(S::Error::custom)?);
        object.serialize(serializer)
    }
}
