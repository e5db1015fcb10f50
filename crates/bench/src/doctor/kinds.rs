//! Ways in which a data set is stored wrongly and still looks right: [`kinds`].

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};
use strum::IntoEnumIterator as _;

use touch2touch_core::doubt::Cause;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::read_as::{Colors, Depths, Images, Lay, ReadAs, Stored};
use touch2touch_core::sample::{ColorTouch, DepthTouch, PadTouch, Sample};

/// Pairs with their tools, and the tools' CAD models.
#[derive(Clone)]
pub(super) struct Set {
    pub(super) pairs: Vec<(String, Sample)>,
    pub(super) tools: BTreeMap<String, TriMesh>,
}

/// One way to store a data set wrongly.
pub(super) struct Kind {
    pub(super) name: String,
    spoil: Box<dyn Fn(&mut Set) + Send + Sync>,
    /// The causes that name it.
    named: Vec<String>,
}

impl Kind {
    /// A copy of a sound set, stored so.
    pub(super) fn of(&self, sound: &Set) -> Set {
        let mut set = sound.clone();
        (self.spoil)(&mut set);
        set
    }

    /// True where the cause names this kind.
    pub(super) fn is(&self, cause: &Cause) -> bool {
        self.named.contains(&cause.key())
    }
}

fn kind(name: &str, named: &[&str], spoil: impl Fn(&mut Set) + Send + Sync + 'static) -> Kind {
    let named = named.iter().map(|&name| name.to_owned()).collect();
    Kind { name: name.to_owned(), spoil: Box::new(spoil), named }
}

/// Kind that a reading undoes, by its opposite.
fn stored(name: &str, undone_by: &[&str], mistake: ReadAs) -> Kind {
    kind(name, undone_by, move |set| set.pairs.iter_mut().for_each(|(_, sample)| mistake.apply(sample)))
}

/// All ways.
pub(super) fn kinds() -> Vec<Kind> {
    imprints().into_iter().chain(poses()).chain(models()).chain(images()).chain(parts()).collect()
}

fn imprints() -> Vec<Kind> {
    let mut all = vec![stored("theta negated", &["negate-theta"], ReadAs::NegateTheta)];
    for (depths, of) in [(Depths::Imprints, "imprints"), (Depths::Whole, "imprints and references")] {
        let swap = ["swap-fingers", "whole-swap-fingers"];
        all.push(stored(&format!("{of} of the fingers swapped"), &swap, ReadAs::SwapFingers(depths)));
        for (lay, key) in
            [(Lay::MirrorColumns, "mirror-columns"), (Lay::MirrorRows, "mirror-rows"), (Lay::Turn, "turn")]
        {
            let whole = format!("whole-{key}");
            all.push(stored(&format!("{of}: {key}"), &[key, &whole], ReadAs::Lay(depths, lay)));
        }
        for (factor, undone) in [(0.1, "10"), (0.5, "2"), (2.0, "0.5"), (10.0, "0.1")] {
            let named = [format!("scale-depth={undone}"), format!("whole-scale-depth={undone}")];
            all.push(stored(&format!("{of} x {factor}"), &[&named[0], &named[1]], ReadAs::Scale(depths, factor)));
        }
    }
    all.push(stored("imprints negated", &["scale-depth=-1"], ReadAs::Scale(Depths::Imprints, -1.0)));
    for (factor, undone) in [(0.5, "2"), (0.8, "1.25"), (1.25, "0.8"), (2.0, "0.5")] {
        let named = format!("scale-camera={undone}");
        all.push(stored(&format!("K x {factor}"), &[&named], ReadAs::ScaleCamera(factor)));
    }
    all
}

/// A way to store all depth touches slightly wrongly.
fn depths(name: &str, named: &[&str], change: impl Fn(&mut DepthTouch) + Send + Sync + 'static) -> Kind {
    kind(name, named, move |set| {
        let touches = set.pairs.iter_mut().flat_map(|(_, sample)| sample.pads.iter_mut().flatten());
        touches.filter_map(PadTouch::depth_mut).for_each(&change);
    })
}

/// Small faults that no reading mends. That nothing goes together is always true of them.
pub(super) fn near() -> Vec<Kind> {
    let moved = ["unexplained", "poses-unknown", "poses-grasp-frame", "poses-object-frame", "poses-angle"];
    let unknown = &moved[..2];
    let reference = |factor: f32| {
        depths(&format!("depths without contact x {factor}"), unknown, move |touch| {
            if let Some(camera) = &mut touch.camera {
                camera.depth_reference = camera.depth_reference.map(|v| v * factor);
            }
        })
    };
    let model = |name: &str, by_m: DVec3| {
        kind(&format!("CAD models 3 mm off along {name}"), &moved, move |set| {
            set.tools.values_mut().flat_map(|mesh| &mut mesh.vertices).for_each(|vertex| *vertex += by_m);
        })
    };
    let back = |by_m: f64| {
        depths(&format!("cameras {} mm further back", 1e3 * by_m), unknown, move |touch| {
            if let Some(camera) = &mut touch.camera {
                // Along its optical axis.
                camera.grasp_from_camera.translation -= by_m * camera.grasp_from_camera.matrix3.z_axis;
            }
        })
    };
    let crop = |by_px: f64| {
        depths(&format!("center of the camera matrix {by_px} px off"), &moved, move |touch| {
            if let Some(camera) = &mut touch.camera {
                camera.intrinsics.cx += by_px;
            }
        })
    };
    vec![
        depths("imprints x 1.15", unknown, |touch| touch.imprint = touch.imprint.map(|v| 1.15 * v)),
        stored("imprints and references x 1.15", unknown, ReadAs::Scale(Depths::Whole, 1.15)),
        reference(1.1),
        reference(0.95),
        model("x", DVec3::X * 3e-3),
        model("y", DVec3::Y * 3e-3),
        model("z", DVec3::Z * 3e-3),
        back(0.005),
        back(0.008),
        depths("imprints 6 px off their references", &moved, |touch| {
            let map = &touch.imprint;
            let [width, height] = map.size();
            touch.imprint = DepthMap::from_fn(width, height, |x, y| map[(x.saturating_sub(6), y)]);
        }),
        crop(6.0),
        crop(12.0),
    ]
}

/// A way to store what the first finger felt wrongly.
fn finger(name: &str, named: &str, change: impl Fn(&mut PadTouch) + Send + Sync + 'static) -> Kind {
    kind(&format!("one finger: {name}"), &[named], move |set| {
        set.pairs.iter_mut().filter_map(|(_, sample)| sample.pads.iter_mut().flatten().next()).for_each(&change);
    })
}

fn lay_images(touch: &mut PadTouch, lay: Lay) {
    let Some(color) = touch.color_mut() else { return };
    let Some(images) = &color.images else { return };
    let [raw, reference] = [&images.raw, &images.reference].map(|image| lay.turn().apply(image));
    if let Some(laid) = ColorTouch::from_images(raw, reference) {
        *color = laid;
    }
}

/// Mistakes of the first finger alone, or of every second pair.
fn parts() -> Vec<Kind> {
    let imprint = |name: &str, named: &str, change: fn(&DepthMap) -> DepthMap| {
        finger(name, named, move |touch| {
            if let Some(depth) = touch.depth_mut() {
                depth.imprint = change(&depth.imprint);
            }
        })
    };
    let every_second = |name: &str, named: &str, change: fn(&mut Sample)| {
        kind(&format!("every second pair: {name}"), &[named], move |set| {
            set.pairs.iter_mut().skip(1).step_by(2).for_each(|(_, sample)| change(sample));
        })
    };
    vec![
        imprint("imprints mirrored", "finger-mirror-columns", |map| Lay::MirrorColumns.turn().apply(map)),
        imprint("imprints turned", "finger-turn", |map| Lay::Turn.turn().apply(map)),
        imprint("imprints negated", "finger-scale-depth=-1", |map| map.map(|v| -v)),
        imprint("imprints constant", "nothing-felt", |map| map.map(|_| 0.004)),
        finger("touched GelSlims are untouched", "same-images", |touch| {
            if let Some(images) = touch.color_mut().and_then(|color| color.images.as_mut()) {
                images.raw = images.reference.clone();
            }
        }),
        finger("GelSlims mirrored top to bottom", "finger-image-mirror-rows", |touch| {
            lay_images(touch, Lay::MirrorRows)
        }),
        finger("GelSlims turned", "finger-image-turn", |touch| lay_images(touch, Lay::Turn)),
        every_second("GelSlims of the fingers swapped", "swapped-in-some", |sample| {
            ReadAs::ImageSwapFingers.apply(sample)
        }),
        kind("every second pair: named after another tool", &["other-tool-of-some", "other-tool"], |set| {
            let names: Vec<String> = set.pairs.iter().map(|(name, _)| name.clone()).collect();
            let others = names.iter().cycle().skip(1).step_by(2);
            set.pairs.iter_mut().step_by(2).zip(others).for_each(|((name, _), other)| name.clone_from(other));
        }),
    ]
}

/// A way to store true poses wrongly, from `object_from_grasp`, which the lab stores, to itself.
fn pose(name: &str, named: &[&str], change: impl Fn(PlanarPose) -> PlanarPose + Send + Sync + 'static) -> Kind {
    kind(&format!("true poses: {name}"), named, move |set| {
        for (_, sample) in &mut set.pairs {
            sample.grasp_from_object = sample.grasp_from_object.map(|pose| change(pose.inverse()).inverse());
        }
    })
}

fn poses() -> Vec<Kind> {
    let mut all = vec![
        pose("inverse", &["poses-inverse"], PlanarPose::inverse),
        pose("angles doubled", &["poses-factor"], |lab| PlanarPose { theta_rad: 2.0 * lab.theta_rad, ..lab }),
        pose("angles halved", &["poses-factor"], |lab| PlanarPose { theta_rad: 0.5 * lab.theta_rad, ..lab }),
        pose("angles zero", &["poses-constant"], |lab| PlanarPose { theta_rad: 0.0, ..lab }),
        pose("another grasp frame", &["poses-grasp-frame"], |lab| {
            lab.compose(PlanarPose { theta_rad: 0.2, y_m: 0.01, z_m: -0.015 })
        }),
        kind("true poses: of the pair before", &["poses-neighbor"], |set| {
            let poses: Vec<_> = set.pairs.iter().map(|(_, sample)| sample.grasp_from_object).collect();
            let before = poses.iter().cycle().skip(poses.len().saturating_sub(1));
            set.pairs.iter_mut().zip(before).for_each(|((_, sample), pose)| sample.grasp_from_object = *pose);
        }),
    ];
    for degrees in [5.0f64, -10.0, 15.0] {
        all.push(pose(&format!("angles {degrees}° too large"), &["poses-angle"], move |lab| PlanarPose {
            theta_rad: lab.theta_rad + degrees.to_radians(),
            ..lab
        }));
    }
    for degrees in [5.0f64, 10.0] {
        all.push(kind(&format!("CAD models turned by {degrees}°"), &["poses-angle"], move |set| {
            let turn = DMat3::from_rotation_x(degrees.to_radians());
            set.tools.values_mut().flat_map(|mesh| &mut mesh.vertices).for_each(|vertex| *vertex = turn * *vertex);
        }));
    }
    all
}

fn models() -> Vec<Kind> {
    let mut all = Vec::new();
    for step in [1usize, 2, 3] {
        all.push(kind(&format!("CAD models of other tools, {step} further"), &["other-tool"], move |set| {
            let meshes: Vec<TriMesh> = set.tools.values().cloned().collect();
            let count = meshes.len();
            set.tools.values_mut().enumerate().for_each(|(i, mesh)| *mesh = meshes[(i + step) % count].clone());
        }));
    }
    all.push(kind("two CAD models exchanged", &["other-tool"], |set| {
        let names: Vec<String> = set.tools.keys().take(2).cloned().collect();
        if let [a, b] = &names[..] {
            let (first, second) = (set.tools[a].clone(), set.tools[b].clone());
            set.tools.insert(a.clone(), second);
            set.tools.insert(b.clone(), first);
        }
    }));
    all.push(kind("one CAD model over another", &["other-tool", "not-its-model"], |set| {
        let meshes: Vec<TriMesh> = set.tools.values().take(2).cloned().collect();
        if let (Some(first), [_, other]) = (set.tools.values_mut().next(), &meshes[..]) {
            *first = other.clone();
        }
    }));
    let axes: [(&str, &str, TurnModel); 9] = [
        ("mirrored along y", "-x-yz", |p| DVec3::new(p.x, -p.y, p.z)),
        ("mirrored along z", "-xy-z", |p| DVec3::new(p.x, p.y, -p.z)),
        ("turned by 180 degrees about x", "x-y-z", |p| DVec3::new(p.x, -p.y, -p.z)),
        ("turned by 90 degrees about x", "xz-y", |p| DVec3::new(p.x, -p.z, p.y)),
        ("y and z exchanged", "-xzy", |p| DVec3::new(p.x, p.z, p.y)),
        ("x and y exchanged", "-yxz", |p| DVec3::new(p.y, p.x, p.z)),
        ("x and z exchanged", "-zyx", |p| DVec3::new(p.z, p.y, p.x)),
        ("z, x, y", "yzx", |p| DVec3::new(p.z, p.x, p.y)),
        ("y, z, x", "zxy", |p| DVec3::new(p.y, p.z, p.x)),
    ];
    for (name, axes, turn) in axes {
        all.push(kind(&format!("CAD models: {name}"), &[&format!("cad-axes={axes}")], move |set| {
            for vertex in set.tools.values_mut().flat_map(|mesh| &mut mesh.vertices) {
                *vertex = turn(*vertex);
            }
        }));
    }
    all
}

/// A way to store the color images of all touches wrongly, from touched and untouched image.
fn images_of(
    name: &str,
    named: &[&str],
    change: impl Fn(&RgbGrid, &RgbGrid) -> (RgbGrid, RgbGrid) + Send + Sync + 'static,
) -> Kind {
    kind(name, named, move |set| {
        for color in set.pairs.iter_mut().flat_map(|(_, sample)| sample.pads.iter_mut().flatten()) {
            let Some(color) = PadTouch::color_mut(color) else { continue };
            let Some(images) = &color.images else { continue };
            let (raw, reference) = change(&images.raw, &images.reference);
            if let Some(changed) = ColorTouch::from_images(raw, reference) {
                *color = changed;
            }
        }
    })
}

fn each(image: &RgbGrid, change: impl Fn(f32) -> f32) -> RgbGrid {
    image.map(|pixel| pixel.map(&change))
}

fn difference(a: &RgbGrid, b: &RgbGrid, change: impl Fn(f32) -> f32) -> RgbGrid {
    RgbGrid::from_fn(a.width(), a.height(), |x, y| std::array::from_fn(|c| change(a[(x, y)][c] - b[(x, y)][c])))
}

fn gray(image: &RgbGrid) -> RgbGrid {
    image.map(|p| [0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2]; 3])
}

/// Place that a corner of a CAD model is moved to.
type TurnModel = fn(DVec3) -> DVec3;

/// Stored value of a difference.
type Store = fn(f32) -> f32;

fn black(image: &RgbGrid) -> RgbGrid {
    each(image, |_| 0.0)
}

/// As 8 bits with a sign hold it.
fn signed(v: f32) -> f32 {
    (v + 128.0).rem_euclid(256.0) - 128.0
}

fn images() -> Vec<Kind> {
    let gelslims = |name: &str, mistake: ReadAs| stored(&format!("GelSlims: {name}"), &[&mistake.to_string()], mistake);
    let signs = ReadAs::ImageIsDifference(Stored::Signed).to_string();
    let grays = ReadAs::ImageIsDifference(Stored::Gray).to_string();
    let wraps = ReadAs::ImageIsDifference(Stored::Wrapped).to_string();
    let scale = |which| ReadAs::Image255(which).to_string();
    let mut all = vec![
        gelslims("fingers swapped", ReadAs::ImageSwapFingers),
        gelslims("mirrored left to right", ReadAs::ImageLay(Lay::MirrorColumns)),
        gelslims("mirrored top to bottom", ReadAs::ImageLay(Lay::MirrorRows)),
        gelslims("turned by 180 degrees", ReadAs::ImageLay(Lay::Turn)),
        gelslims("both BGR", ReadAs::ImageBgr(Images::Both)),
        gelslims("negatives", ReadAs::ImageNegative),
        gelslims("touched ones BGR", ReadAs::ImageBgr(Images::Touch)),
        gelslims("untouched ones BGR", ReadAs::ImageBgr(Images::Reference)),
        gelslims("touched and untouched swapped", ReadAs::ImageSwapReference),
        images_of("GelSlims: both 0..1", &[&scale(Images::Both)], |a, b| {
            (each(a, |v| v / 255.0), each(b, |v| v / 255.0))
        }),
        images_of("GelSlims: touched ones 0..1", &[&scale(Images::Touch)], |a, b| (each(a, |v| v / 255.0), b.clone())),
        images_of("GelSlims: untouched ones 0..1", &[&scale(Images::Reference)], |a, b| {
            (a.clone(), each(b, |v| v / 255.0))
        }),
        images_of("GelSlims: untouched is touched", &["same-images"], |a, _| (a.clone(), a.clone())),
        images_of("GelSlims: touched is untouched", &["same-images"], |_, b| (b.clone(), b.clone())),
        images_of("GelSlims: no untouched image", &["no-reference"], |a, b| (a.clone(), black(b))),
        images_of("GelSlims: white untouched image", &["no-reference"], |a, b| (a.clone(), each(b, |_| 255.0))),
        images_of("GelSlims: gray", &["gray"], |a, b| (gray(a), gray(b))),
    ];
    for colors in Colors::iter() {
        let named = ReadAs::ImageColors(colors).to_string();
        let name = format!("GelSlims: {}", <&str>::from(colors));
        all.push(images_of(&name, &[&named], move |a, b| {
            let stored = |image: &RgbGrid| image.map(|pixel| colors.encoded(*pixel));
            (stored(a), stored(b))
        }));
    }
    let differences: [(&str, &str, Store); 3] = [
        ("signed", &signs, |v| v),
        ("gray added", &grays, |v| (v + 128.0).clamp(0.0, 255.0)),
        ("wrapped", &wraps, |v| v.rem_euclid(256.0)),
    ];
    for (name, key, store) in differences {
        for (beside, reference) in [("untouched image kept", 1.0), ("no untouched image", 0.0)] {
            all.push(kind(&format!("GelSlims: differences stored, {name}, {beside}"), &[key], move |set| {
                for color in set.pairs.iter_mut().flat_map(|(_, sample)| sample.pads.iter_mut().flatten()) {
                    let Some(color) = PadTouch::color_mut(color) else { continue };
                    let Some(images) = &color.images else { continue };
                    let stored = difference(&images.raw, &images.reference, store);
                    let untouched = each(&images.reference, |v| v * reference);
                    if let Some(changed) = ColorTouch::from_images(stored, untouched) {
                        *color = changed;
                    }
                }
            }));
        }
    }
    let unwrap = ReadAs::ImageUnwrap.to_string();
    all.extend([
        images_of("GelSlims: 8 bits with a sign", &[&unwrap], |a, b| (each(a, signed), each(b, signed))),
        images_of("GelSlims: touched ones in 8 bits with a sign", &[&unwrap], |a, b| (each(a, signed), b.clone())),
        images_of("GelSlims: brightened by 90 and wrapped", &[&unwrap], |a, b| {
            let brighter = |v: f32| (v + 90.0).rem_euclid(256.0);
            (each(a, brighter), each(b, brighter))
        }),
    ]);
    all
}
