//! Commands at random: as they come from a window, and as they come from nowhere.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Mat4};
use proptest::prelude::*;
use proptest::sample::select;
use proptest::strategy::Union;
use strum::IntoEnumIterator;
use touch2touch::app::command::{
    Answer, CameraPreset, Command, DoctorCommand, EvaluateCommand, ExportCommand, FollowCommand, Hover, InspectCommand,
    LabelsCommand, LearnCommand, LibraryCommand, Pane, PredictCommand, SettingsCommand, TasksCommand, UiRequest,
    UnsavedCommand, ViewCommand, WorkbenchCommand,
};
use touch2touch::app::effect::{LabelsToSave, NotSaved, TaskResult};
use touch2touch::app::evaluate::ScoreChoice;
use touch2touch::app::export::{Output, StillAsked};
use touch2touch::app::keys::{
    DatasetSeq, ImprintSource, PairKey, PredictionKey, Registration, Revision, ShiftMode, TouchKey,
};
use touch2touch::app::keys::{PictureKey, Preview};
use touch2touch::app::labels::{PairLabels, Review, StrokeIn3d};
use touch2touch::app::learn::{AdaptPairs, LearnForm, Learned, Network};
use touch2touch::app::library::{Place, Sort};
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{
    Change, ColorMap, ColorRange, CompareChoice, CompareMode, GelView, GenerateSettings, Last, MaskChoice,
    MaskSettings, MaskSource, MaskTool, SceneLayer, SceneLook, Settings, SpacePane, Theme, Workspace,
};
use touch2touch::app::source::{Followed, Source};
use touch2touch::app::state::results::{Computed, Request};
use touch2touch::app::tasks::{TaskKind, Ticket};
use touch2touch::app::workbench::{Layer, Picked, SceneTool};
use touch2touch::app::{doctor, evaluate, export, learn, library, predict, tasks};
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::evaluation::Metric;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::label::{CleanKind, CleanUp, Layers, Paint, Sight};
use touch2touch_core::manual::PoseAxis;
use touch2touch_core::pose::Gate;
use touch2touch_core::rig::{PadId, lab};
use touch2touch_pipeline::compare::Beside;
use touch2touch_pipeline::compare::subject::Subject;
use touch2touch_pipeline::doctor::{Cure, Examined, Worth};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::import::Import;
use touch2touch_pipeline::export::{ExportChoice, Which};
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::io::dataset::ToolUnit;
use touch2touch_pipeline::io::exchange::Format;
use touch2touch_pipeline::io::statistics::ShiftStatistics;
use touch2touch_pipeline::job::{PreviewPicture, Progress};
use touch2touch_pipeline::labels::Operation;
use touch2touch_pipeline::learn::train::{MasksFrom, TrainChoice};
use touch2touch_pipeline::scores::evaluate::{Evaluation, Setup};
use touch2touch_pipeline::steps::tool::UnitSet;
use touch2touch_pipeline::still::space::{Ground, ViewAngles};

use super::super::answered::{adapted, trained};
use super::super::bench::models;

fn position() -> impl Strategy<Value = [f32; 2]> {
    prop_oneof![
        8 => [-3.0f32..27.0, -3.0f32..19.0],
        1 => Just([f32::NAN, 1.0]),
        1 => Just([1e30, -1e30]),
    ]
}

fn finger() -> impl Strategy<Value = PadId> {
    prop_oneof![Just(lab::RIGHT), Just(lab::LEFT)]
}

fn any_of<T: IntoEnumIterator + Clone + std::fmt::Debug + 'static>() -> impl Strategy<Value = T> {
    select(T::iter().collect::<Vec<_>>())
}

fn source() -> impl Strategy<Value = ImprintSource> {
    select(vec![ImprintSource::Measured, ImprintSource::Predicted])
}

fn pair() -> impl Strategy<Value = PairId> {
    prop_oneof![6 => 0u32..13, 1 => Just(u32::MAX)].prop_map(PairId)
}

fn touch() -> impl Strategy<Value = TouchKey> {
    (pair(), finger()).prop_map(|(pair, finger)| PairKey { dataset: DatasetSeq(1), pair }.finger(finger))
}

fn recipe() -> impl Strategy<Value = PredictionKey> {
    let recipe = |(touch, seed)| {
        let config = GenerateConfig { steps: 20, seed, ..GenerateConfig::default() };
        PredictionKey { touch, bundle: "gen".into(), config, runtime: EngineChoice::Auto }
    };
    (touch(), 40u64..50).prop_map(recipe)
}

/// Numbers as they come from sliders, and as they come from nowhere.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![6 => -2.0f32..40.0, 1 => Just(f32::NAN), 1 => Just(f32::INFINITY), 1 => Just(-1e30)]
}

fn point() -> impl Strategy<Value = DVec3> {
    [number(), number(), number()].prop_map(|p| DVec3::from(p.map(f64::from)))
}

fn cure() -> impl Strategy<Value = Cure> {
    prop_oneof![
        [number(), number()].prop_map(|[min_m, max_m]| Cure::FitRange { min_m, max_m }),
        any_of::<ToolUnit>().prop_map(|unit| Cure::ReadTool { tool: "tool_a".into(), unit, replacing: None }),
        select(vec!["", "swap-fingers", "swap-toes"]).prop_map(|list| Cure::ReadAs { list: list.into() }),
        any::<usize>().prop_map(|pairs| Cure::Fit { pairs }),
        any::<usize>().prop_map(|pairs| Cure::TrainFromCad { pairs }),
        any::<usize>().prop_map(|pairs| Cure::Examine { pairs }),
    ]
}

fn scene() -> impl Strategy<Value = SceneLook> {
    (any_of::<SceneLayer>(), number()).prop_map(|(layer, distance_m)| {
        let mut scene = SceneLook { distance_m, ..SceneLook::default() };
        scene.toggle(layer);
        scene
    })
}

fn subject() -> impl Strategy<Value = Subject> {
    let texts = [
        "measured",
        "prediction",
        "prediction:seed=7",
        "prediction:bundle=gen,steps=3,shift=raw",
        "prediction:bundle=\"not there, really\"",
        "mean:seeds=2",
        "stored",
    ];
    select(texts.map(|text| text.parse().expect("a subject")).to_vec())
}

fn compare_choice() -> impl Strategy<Value = CompareChoice> {
    (subject(), subject(), any_of::<CompareMode>()).prop_map(|(a, b, mode)| CompareChoice { a, b, mode })
}

fn planar() -> impl Strategy<Value = PlanarPose> {
    point().prop_map(|p| PlanarPose { theta_rad: p.x, y_m: p.y * 1e-3, z_m: p.z * 1e-3 })
}

fn place() -> impl Strategy<Value = Place> {
    select(vec![Place::Path("missing".into()), Place::Path("elsewhere".into())])
}

fn shift() -> impl Strategy<Value = ShiftMode> {
    any_of::<ShiftMode>()
}

fn error() -> impl Strategy<Value = TaskError> {
    select(vec![TaskError::new("Something", "it did not work"), TaskError::cancelled("Something")])
}

fn unsaved() -> impl Strategy<Value = UnsavedCommand> {
    select(vec![
        UnsavedCommand::Close,
        UnsavedCommand::Stay,
        UnsavedCommand::Discard,
        UnsavedCommand::Retry,
        UnsavedCommand::AskFolder,
        UnsavedCommand::Elsewhere("/dev/null/folder".into()),
    ])
}

fn demo() -> Arc<Source> {
    Arc::new(Source::open(&Place::Demo, None).expect("it is built in"))
}

fn not_saved(seq: DatasetSeq) -> Box<NotSaved> {
    let (name, labels, deed) = ("tool_a/data_0".to_owned(), PairLabels::default(), Operation::default());
    let save = LabelsToSave { seq, name, revision: Revision(1), labels, deed };
    let err = TaskError::new("Save the labels", "no space left");
    Box::new(NotSaved { source: demo(), save, err })
}

fn ticket() -> impl Strategy<Value = Ticket> {
    (0u64..12).prop_map(Ticket)
}

fn generate() -> impl Strategy<Value = GenerateSettings> {
    (0u32..30, any::<u64>(), number(), any::<bool>()).prop_map(|(steps, seed, eta, both)| GenerateSettings {
        steps,
        seed,
        eta: eta.into(),
        both_fingers: both,
        ..GenerateSettings::default()
    })
}

fn mask() -> impl Strategy<Value = MaskSettings> {
    (any_of::<MaskTool>(), any_of::<MaskSource>(), number(), number()).prop_map(|(tool, source, radius_px, percent)| {
        let choice = MaskChoice { source, top_percent: percent, ..MaskChoice::default() };
        MaskSettings { tool, radius_px, choice, ..MaskSettings::default() }
    })
}

/// Something that a person changes about the preferences.
pub(super) fn change() -> impl Strategy<Value = Change> {
    let range = (number(), number(), any::<bool>());
    let range = range.prop_map(|(min_m, max_m, locked)| ColorRange { min_m, max_m, locked });
    let person = select(vec![String::new(), " Anna ".into(), "x".repeat(200)]);
    prop_oneof![
        1 => any_of::<Theme>().prop_map(|v| prefer(move |s| s.theme = v)),
        1 => number().prop_map(|v| prefer(move |s| s.ui_zoom = v)),
        1 => range.prop_map(|v| prefer(move |s| s.range = v)),
        1 => any_of::<ColorMap>().prop_map(|v| prefer(move |s| s.color_map = v)),
        1 => shift().prop_map(|v| prefer(move |s| s.shift = v)),
        1 => generate().prop_map(|v| prefer(move |s| s.generate = v.clone())),
        1 => mask().prop_map(|v| prefer(move |s| s.mask = v.clone())),
        4 => any_of::<MaskTool>().prop_map(|v| prefer(move |s| s.mask.tool = v)),
        3 => any_of::<Paint>().prop_map(|v| prefer(move |s| s.mask.paint = v)),
        2 => any_of::<MaskSource>().prop_map(|v| prefer(move |s| s.mask.choice.source = v)),
        1 => number().prop_map(|v| prefer(move |s| s.mask.radius_px = v)),
        1 => any::<[bool; 4]>().prop_map(|[visible, outline, footprint, hint]| {
            prefer(move |s| {
                (s.mask_visible, s.mask_outline, s.footprint_visible) = (visible, outline, footprint);
                s.hint_dismissed = hint;
            })
        }),
        1 => number().prop_map(|v| prefer(move |s| s.mask_opacity = v)),
        1 => registration().prop_map(|v| prefer(move |s| s.registration = v)),
        1 => select(EngineChoice::all().collect::<Vec<_>>()).prop_map(|v| prefer(move |s| s.runtime = v)),
        1 => person.prop_map(|v| prefer(move |s| s.person = v.clone())),
        1 => any::<u32>().prop_map(|v| prefer(move |s| s.cache_mib = v)),
        1 => scene().prop_map(|v| prefer(move |s| s.scene = v.clone())),
        1 => any_of::<SpacePane>().prop_map(|sides| prefer(move |s| _ = s.sides.insert(s.workspace, sides))),
        1 => any_of::<GelView>().prop_map(|gel| prefer(move |s| s.gel = gel)),
        1 => compare_choice().prop_map(|v| prefer(move |s| *s.compare_mut() = v.clone())),
        1 => any_of::<Workspace>().prop_map(|v| prefer(move |s| s.workspace = v)),
    ]
    .prop_map(|command| match command {
        SettingsCommand::Change(change) => change,
        other => unreachable!("{other:?}"),
    })
}

fn registration() -> impl Strategy<Value = Registration> {
    prop_oneof![
        any_of::<Registration>(),
        (1e-4..0.02).prop_map(|m| Registration::DistanceField(Some(Gate::new(m).unwrap()))),
    ]
}

fn mask_choice() -> impl Strategy<Value = ExportChoice> {
    let flags = (any_of::<Which>(), any::<[bool; 3]>(), any::<u64>(), any_of::<Format>());
    flags.prop_map(|(which, [test_in_train, by_tool, manual_checked], seed, format)| ExportChoice {
        which,
        test_in_train,
        by_tool,
        manual_checked,
        seed,
        format,
    })
}

fn still() -> impl Strategy<Value = StillAsked> {
    let still = (any_of::<SpacePane>(), any::<u32>(), any_of::<Ground>(), any::<[f64; 2]>(), any::<Option<u32>>());
    still.prop_map(|(pane, width_px, ground, [yaw_deg, pitch_deg], turntable)| {
        let angles = ViewAngles { yaw_deg, pitch_deg };
        StillAsked { pane, width_px, ground, angles, turntable }
    })
}

fn output() -> impl Strategy<Value = Output> {
    prop_oneof![Just(Output::Masks), source().prop_map(Output::Pair), still().prop_map(Output::Still),]
}

fn statistics() -> ShiftStatistics {
    let text = r#"{"format": "", "version": 1, "bundle": "gen", "bundle_hash": "gen", "dataset": "Double", "seed": 0,
        "steps": 20, "sampler": "ddim", "eta": 0.0, "engine": "double", "scale": "assumed", "made": "", "touches": 2,
        "predicted_pixels": 9, "measured_pixels": 9, "left_out": [0, 0], "extremes_m": [[0.0, 1.0], [0.0, 1.0]],
        "stats": {"pred_mean": 0.1, "pred_std": 0.1, "gt_mean": 0.1, "gt_std": 0.1}}"#;
    serde_json::from_str(text).expect("the statistics are whole")
}

fn evaluation() -> Evaluation {
    Evaluation {
        dataset: "Double".into(),
        rows: Vec::new(),
        groups: Vec::new(),
        conventions: "".into(),
        notes: Vec::new(),
        findings: Vec::new(),
        skipped: Vec::new(),
        scored: 0,
        of: 0,
        complete: true,
        setup: Setup::default(),
        runtime: String::new(),
        scores: Default::default(),
        seconds: 0.0,
    }
}

/// A number of an opening that never was.
const NEVER: DatasetSeq = DatasetSeq(u32::MAX);

/// A picture that lies beside no pair.
fn beside() -> Beside {
    Beside { tile: DepthMap::filled(2, 2, 0.0), imprint: DepthMap::filled(2, 2, 0.0) }
}

fn followed() -> Followed {
    Followed {
        source: demo(),
        pair: PairId(0),
        completed: false,
        sample: Err(TaskError::new("Load", "it is half written")),
    }
}

/// The end of a task of any kind, as empty as it can be. A kind that has none does not compile.
fn ended() -> impl Strategy<Value = TaskResult> {
    (any_of::<TaskKind>(), select(vec!["tool_a/data_0", "elsewhere"]), select(vec![DatasetSeq(1), NEVER])).prop_map(
        |(kind, name, seq)| match kind {
            TaskKind::Open => TaskResult::new(kind, (NEVER, Place::Path(name.into()), demo()), library::opened),
            TaskKind::ReadTool => {
                let (tool, word, file) = ("tool_a".into(), "mm".into(), "unit.txt".into());
                let set = UnitSet { tool, unit: ToolUnit::Millimeters, file, word, not_written: None };
                TaskResult::new(kind, (seq, set), library::tool_read)
            }
            TaskKind::Generate => TaskResult::new(kind, Vec::new(), predict::generated),
            TaskKind::Refit => TaskResult::new(kind, (statistics(), None), predict::refitted),
            TaskKind::Write => TaskResult::new(kind, ("Something".into(), "/dev/null/folder".into()), tasks::written),
            TaskKind::Import => TaskResult::new(
                kind,
                Import { new: 1, changed: vec![name.to_owned()], ..Import::default() },
                export::imported,
            ),
            TaskKind::Evaluate => TaskResult::new(kind, Arc::new(evaluation()), evaluate::scored),
            TaskKind::TryModels => TaskResult::new(kind, Some(Arc::new(Worth::default())), doctor::tried),
            TaskKind::Examine => TaskResult::new(kind, Arc::new(Examined::default()), doctor::examined),
            TaskKind::ReadOtherwise => {
                TaskResult::new(kind, (seq, "read-as.txt".into(), "swap-fingers".into()), doctor::read_otherwise)
            }
            TaskKind::Learn if seq.0 % 2 == 0 => {
                TaskResult::new(kind, Learned::Generator(Arc::new(adapted()), None), learn::learned)
            }
            TaskKind::Learn => {
                let bundle = models().remove(1);
                TaskResult::new(kind, Learned::Masks(Arc::new(trained()), bundle), learn::learned)
            }
        },
    )
}

/// One way to draw each command of a room, with its weight. A command that is not drawn does not compile.
macro_rules! draws {
    ($( $name:ident: $command:ident { $( $weight:literal $variant:ident $(($($each:expr),+))?, )* } )*) => {
        $( fn $name() -> impl Strategy<Value = Command> {
            let all = |command: &$command| match command { $( $command::$variant { .. } => {} )* };
            let ways = vec![ $( ($weight, draws!(one $command $variant $($($each),+)?)), )* ];
            Union::new_weighted(ways).prop_map(move |command| {
                all(&command);
                command.into()
            })
        } )*
    };
    (one $command:ident $variant:ident) => { Just($command::$variant).boxed() };
    (one $command:ident BeginStroke $a:expr, $b:expr, $c:expr, $d:expr) => {
        ($a, $b, $c, $d)
            .prop_map(|(finger, source, at_px, erase)| $command::BeginStroke { finger, source, at_px, erase })
            .boxed()
    };
    (one $command:ident ReadToolAs $a:expr, $b:expr, $c:expr) => {
        ($a, $b, $c).prop_map(|(tool, unit, replacing)| $command::ReadToolAs { tool, unit, replacing }).boxed()
    };
    (one $command:ident BindKey $a:expr, $b:expr, $c:expr) => {
        ($a, $b, $c).prop_map(|(action, place, shortcut)| $command::BindKey { action, place, shortcut }).boxed()
    };
    (one $command:ident Go $a:expr, $b:expr) => { ($a, $b).prop_map(|(run, at)| $command::Go { run, at }).boxed() };
    (one $command:ident $variant:ident $a:expr) => { $a.prop_map($command::$variant).boxed() };
    (one $command:ident $variant:ident $a:expr, $b:expr) => {
        ($a, $b).prop_map(|(a, b)| $command::$variant(a, b)).boxed()
    };
    (one $command:ident $variant:ident $a:expr, $b:expr, $c:expr) => {
        ($a, $b, $c).prop_map(|(a, b, c)| $command::$variant(a, b, c)).boxed()
    };
    (one $command:ident $variant:ident $a:expr, $b:expr, $c:expr, $d:expr) => {
        ($a, $b, $c, $d).prop_map(|(a, b, c, d)| $command::$variant(a, b, c, d)).boxed()
    };
}

draws! {
    library: LibraryCommand {
        1 Open(place()),
        1 Reload,
        1 ForgetRecent(place()),
        1 ReadToolAs(Just("tool_a".to_owned()), any_of::<ToolUnit>(), proptest::option::of(Just("in".to_owned()))),
        1 SetFilter(select(vec![String::new(), "tool_a".into(), "is:todo".into(), "angle>5".into(), "nothing like it".into()])),
        1 SetToolFilter(proptest::option::of(Just("tool_b".to_owned()))),
        1 SetSort(any_of::<Sort>()),
        1 SetScore((any::<bool>(), proptest::option::of(any_of::<Metric>())).prop_map(|(best_first, metric)| ScoreChoice {
            metric,
            best_first,
            ..ScoreChoice::default()
        })),
        1 ShowRows((0usize..20, 0usize..40).prop_map(|(a, b)| a..b)),
        4 Select(pair()),
        1 Step(any::<i64>()),
        1 First,
        1 Last,
        1 NextUnfinished,
        1 NextWorst,
        1 DoneAndNext,
    }
    follow: FollowCommand {
        1 Set(any::<bool>()),
    }
    view: ViewCommand {
        3 SelectFinger(finger()),
        1 SelectImprint(source()),
        3 Propose(any::<bool>()),
        2 ShowBothFingers(any::<bool>()),
        1 HoverPixel(proptest::option::of((finger(), position()).prop_map(|(finger, at_px)| Hover { finger, at_px }))),
        1 HoverPoint(proptest::option::of(point())),
        2 ShowPanes(proptest::collection::btree_set(any_of::<Pane>(), 0..22)),
        1 SetPalette(any::<bool>()),
        1 SetShortcutSheet(any::<bool>()),
        1 Ui(select(vec![UiRequest::Fit, UiRequest::Camera(CameraPreset::Top)])),
    }
    predict: PredictCommand {
        3 Generate,
        2 GenerateNewSeed,
        1 Refit,
        1 Choose(recipe()),
    }
    labels: LabelsCommand {
        6 BeginStroke(finger(), source(), position(), any::<bool>()),
        4 BeginIn3d((finger(), source(), position(), point(), any::<bool>()).prop_map(|(finger, source, at_px, size_at, erase)| {
            let sight = Sight { clip_from_grasp: Mat4::IDENTITY, size_px: [64, 48], layers: Layers::All };
            Box::new(StrokeIn3d { finger, source, sight, at_px, size_at, erase })
        })),
        6 StrokeTo(position()),
        6 EndStroke,
        2 Close,
        1 CancelStroke,
        2 Corner(position()),
        4 CleanUp((any_of::<CleanKind>(), number()).prop_map(|(kind, size)| CleanUp { kind, size_mm: size.into() })),
        2 AdoptAutomatic,
        3 AcceptProposal,
        1 ResetMask,
        3 Undo,
        3 Redo,
        2 SetReview(any_of::<Review>()),
        1 SetNote(select(vec!["tool_a/data_0".to_owned(), "no such pair".into()]), select(vec![String::new(), " odd\n edge ".into(), "x".repeat(3000)])),
        1 AcceptPose(source(), any::<bool>()),
        1 Save,
        3 Unsaved(unsaved()),
    }
    inspect: InspectCommand {
        1 Source(source()),
        1 Start(proptest::option::of(planar())),
        1 Run(0usize..4),
        1 Go(0usize..4, 0usize..100),
        1 By(prop_oneof![any::<i64>(), Just(i64::MIN), Just(i64::MAX)]),
        1 Play(any::<bool>()),
    }
    workbench: WorkbenchCommand {
        1 SetLayer(any_of::<Layer>()),
        1 TryTools(any::<bool>()),
        1 SetBothClouds(any::<bool>()),
        3 SetTool(any_of::<SceneTool>()),
        1 SetSide(source()),
        1 Nudge(any_of::<PoseAxis>(), number().prop_map(f64::from)),
        1 SetHandPose(planar()),
        1 NextAnswer,
        1 StartIcp,
        1 AcceptHand,
        1 RevertHand,
        1 Pick(proptest::option::of((source(), finger(), any::<[u16; 2]>())
            .prop_map(|(source, finger, pixel)| Picked { source, finger, pixel }))),
    }
    evaluate: EvaluateCommand {
        1 Choose(Just(Arc::from("gen")), any::<bool>()),
        1 Published(any::<bool>()),
        1 Start,
        1 Export(Just(PathBuf::from("/dev/null/folder"))),
    }
    export: ExportCommand {
        1 AskMasks(any::<bool>()),
        1 SetMasks(mask_choice()),
        1 AskImport(select(vec![None, Some(PathBuf::from("/dev/null/folder"))])),
        1 AskStill(proptest::option::of(still())),
        1 ImportOverHand(any::<bool>()),
        1 Import,
        1 Place(output()),
        1 Write(output(), Just(PathBuf::from("/dev/null/folder/picture.png"))),
    }
    about: DoctorCommand {
        2 Show(any::<bool>()),
        1 Try,
        3 Cure(cure()),
    }
    learn: LearnCommand {
        1 Show(any_of::<Network>()),
        2 SetForm((any::<bool>(), any::<u32>(), any::<u8>(), any::<u64>(), any_of::<AdaptPairs>()).prop_map(|(by_steps, n, held_out_percent, seed, pairs)| {
            let from = if by_steps { MasksFrom::Cad } else { MasksFrom::Drawn };
            let choice = TrainChoice { from, held_out_percent, seed, test_in_train: by_steps };
            LearnForm { pairs, tune: n % 2 == 0, tuning_steps: n, choice, by_steps, minutes: n, steps: n }
        })),
        2 Start(any_of::<Network>()),
        1 Keep,
        2 Use(any_of::<Network>()),
    }
    settings: SettingsCommand {
        24 Change(change()),
        1 RangeFromShown,
        1 SetLayout(any_of::<Workspace>(), Just("{}".to_owned())),
        1 Remember(Just(Last { pair: "nowhere".into(), finger: 7, ..Last::default() })),
        1 ResetSettings,
    }
    tasks: TasksCommand {
        2 Cancel(ticket()),
        1 CancelAll,
        1 Retry,
        1 LogSeen(any::<u64>()),
        1 Report(error()),
        1 Notice(Just("Something".to_owned())),
        1 Saved(Just("Something".to_owned()), Just(PathBuf::from("/dev/null/folder"))),
        1 Reveal(Just(PathBuf::from("/dev/null/folder"))),
    }
    // Answers that nobody waits for, or that come too late.
    answers: Answer {
        1 Followed(Just(NEVER), Just(()).prop_map(|()| followed())),
        1 Bundles(Just(()).prop_map(|()| models()), Just(Vec::new())),
        1 SettingsLoaded(mask().prop_map(|mask| Box::new(Settings { mask, ..Settings::default() })), Just(None)),
        1 Demanded(touch().prop_map(|touch| vec![Request::Sample(touch.pair)])),
        1 Computed(select(vec![DatasetSeq(1), NEVER]),
            touch().prop_map(|touch| Computed::Picture(PictureKey(touch), Arc::new(beside())))),
        1 Previewed(ticket(), recipe().prop_map(|recipe| {
            Arc::new(Preview { recipe, picture: PreviewPicture { step: 1, of: 2, depth: DepthMap::filled(2, 2, 0.0) } })
        })),
        1 Progressed(ticket(), Just(Progress { done: 3, total: 4, text: "step".into(), ..Progress::default() })),
        12 TaskResult(ticket(), ended()),
        1 Done,
        1 TaskFailed(ticket(), error()),
        1 RequestFailed(select(vec![DatasetSeq(1), NEVER]), touch().prop_map(|t| Box::new(Request::Sample(t.pair))), error()),
        1 LabelsSaved(Just("tool_a/data_0".to_owned()), Just(Revision(u64::MAX)), Just(None)),
        1 LabelsFailed(select(vec![DatasetSeq(1), NEVER]).prop_map(not_saved)),
        1 LabelsKept(select(vec![Vec::new(), vec![("tool_a/data_0".to_owned(), Revision(1))]]), Just(PathBuf::from("elsewhere"))),
        1 JobFailed(error()),
    }
}

/// Any command, of every room, with every answer.
pub(super) fn command() -> impl Strategy<Value = Command> {
    let ways = vec![
        (6, library().boxed()),
        (1, follow().boxed()),
        (6, view().boxed()),
        (4, predict().boxed()),
        (36, labels().boxed()),
        (3, inspect().boxed()),
        (4, workbench().boxed()),
        (2, evaluate().boxed()),
        (1, export().boxed()),
        (1, about().boxed()),
        (2, learn().boxed()),
        (8, settings().boxed()),
        (2, tasks().boxed()),
        (3, answers().boxed()),
    ];
    Union::new_weighted(ways).prop_map(|command: Command| {
        // A room that is not among the ways above does not compile.
        match command {
            Command::Library(_) | Command::Follow(_) | Command::View(_) | Command::Predict(_) => {}
            Command::Labels(_)
            | Command::Inspect(_)
            | Command::Workbench(_)
            | Command::Evaluate(_)
            | Command::Export(_)
            | Command::Doctor(_)
            | Command::Learn(_) => {}
            Command::Settings(_) | Command::Tasks(_) | Command::Answer(_) => {}
        }
        command
    })
}
