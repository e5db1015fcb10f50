//! A pair in files for other programs: its cloud as PLY, its pose as JSON, its CAD model in the hand as STL ([`write()`]).

use std::path::{Path, PathBuf};

use glam::DAffine3;
use serde_json::json;

use crate::error::TaskError;
use crate::io::names::{OUTPUT_MARK, output};
use crate::io::ply::{self, PlyPoint};
use crate::io::{atomic, stl};
use crate::labels::ImprintSource;
use crate::steps::cloud::Clouds;
use crate::steps::pose::PoseResult;
use touch2touch_core::deviation;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::pose::{Registration, ToolModel};
use touch2touch_core::rig::Rig;
use touch2touch_core::units::mm;

const WHAT: &str = "Export the pair";

/// Parts that are written of a pair.
#[derive(Clone, Copy, Debug)]
pub struct PairParts<'a> {
    /// Name of the pair.
    pub name: &'a str,
    /// Source of the imprint.
    pub source: ImprintSource,
    /// Origin of the prediction, as [`crate::steps::prediction::predicted_by`] says it; `None` of a measured one.
    pub prediction: Option<&'a str>,
    /// Sensors of the pair.
    pub rig: &'a Rig,
    /// The surface points of that imprint.
    pub clouds: &'a Clouds,
    /// Bases of the contact masks, as [`crate::steps::mask::made_of`] says them.
    pub mask: &'a str,
    /// The registration.
    pub registration: Registration,
    /// Pose by the registration; `None` where there is none.
    pub pose: Option<&'a PoseResult>,
    /// The true pose, `grasp_from_object`, where it is known.
    pub truth: Option<PlanarPose>,
    /// The tool, by name.
    pub tool: Option<(&'a str, &'a ToolModel)>,
}

/// Rows of a 4 x 4 matrix that takes columns `(x, y, z, 1)`.
type Matrix = [[f64; 4]; 4];

const CONVENTION: &str = "grasp_from_object moves points of the CAD model (meters) into the grasp frame: x is the closing \
                          axis, +z where the tool points, y lateral. Matrices are given row by row and take columns \
                          (x, y, z, 1). theta_deg, y_mm and z_mm are those of object_from_grasp, about +x from y towards z, \
                          as the lab reports them.";

fn matrix(motion: DAffine3) -> Matrix {
    let columns = glam::DMat4::from(motion).transpose().to_cols_array_2d();
    // No minus before a zero.
    columns.map(|row| row.map(|v| v + 0.0))
}

/// Writes the surface points of a pair (PLY, with contact, finger and distance to the model) and, where there is one, its
/// pose (JSON) and the CAD model at that pose (STL) into a folder, which is made if it is not there; returns the files.
///
/// # Errors
/// If a file cannot be written.
pub fn write(parts: &PairParts<'_>, folder: &Path) -> Result<Vec<PathBuf>, TaskError> {
    let fail = |why: String, file: &Path| TaskError::new(WHAT, format!("{why} ({})", file.display()));
    std::fs::create_dir_all(folder).map_err(|err| fail(err.to_string(), folder))?;
    let stem = format!("{}{OUTPUT_MARK}{}", output(parts.name), parts.source.key());
    let [cloud, json, mesh] =
        ["cloud.ply", "pose.json", "mesh.stl"].map(|ending| folder.join(format!("{stem}.{ending}")));
    ply::write(&cloud, &points(parts), &comments(parts)).map_err(|err| fail(err.to_string(), &cloud))?;
    let Some((pose, (_, tool))) = parts.pose.zip(parts.tool) else { return Ok(vec![cloud]) };
    let text = pose_json(parts, pose, tool).map_err(|err| fail(err.to_string(), &json))?;
    atomic::write_bytes(&json, text.as_bytes()).map_err(|err| fail(err.to_string(), &json))?;
    let motion = pose.grasp_from_object.to_affine();
    let vertices = tool.mesh.vertices.iter().map(|p| motion.transform_point3(*p)).collect();
    let model = TriMesh { vertices, triangles: tool.mesh.triangles.clone() };
    stl::write(&mesh, &model).map_err(|err| TaskError::from_error(WHAT, &err))?;
    Ok(vec![cloud, json, mesh])
}

fn comments(parts: &PairParts<'_>) -> Vec<String> {
    let fingers: Vec<String> =
        parts.rig.pads().map(|pad| format!("{} = {}", pad.index(), parts.rig.pad_key(pad))).collect();
    let distance = match (parts.pose, parts.tool) {
        (Some(_), Some((tool, _))) => format!("signed, to {tool} as registered by {}", parts.registration),
        _ => "NaN, without a pose".to_owned(),
    };
    let predicted = parts.prediction.map_or_else(String::new, |how| format!(" ({})", how.replace('·', ",")));
    vec![
        "written by touch2touch".into(),
        format!("pair {}, {} imprint{predicted}, contact mask: {}", parts.name, parts.source.key(), parts.mask),
        "unit meters; grasp frame: x closing axis, +z where the tool points, y lateral".into(),
        format!("finger: {}; pixel of its imprint", fingers.join(", ")),
        format!("distance_to_model: meters, {distance}"),
    ]
}

fn points(parts: &PairParts<'_>) -> Vec<PlyPoint> {
    let mut all = Vec::new();
    for (pad, cloud) in parts.clouds.fingers.entries() {
        let distances = parts.pose.zip(parts.tool).map(|(pose, (_, tool))| {
            deviation::of_points(&cloud.points, &pose.grasp_from_object.inverse().to_affine(), &tool.distance)
        });
        for (i, at) in cloud.points.iter().enumerate() {
            all.push(PlyPoint {
                at: *at,
                contact: cloud.contact[i],
                finger: pad.index() as u8,
                pixel: cloud.pixels[i],
                distance: distances.as_ref().map_or(f32::NAN, |found| found[i]),
            });
        }
    }
    all
}

fn pose_json(parts: &PairParts<'_>, pose: &PoseResult, tool: &ToolModel) -> serde_json::Result<String> {
    let back = pose.object_from_grasp();
    let truth = parts.truth.map(|truth| {
        let (back, off) = (truth.inverse(), pose.off(truth, tool));
        json!({
            "grasp_from_object": matrix(pose.grasp_from_cad_at(truth)),
            "theta_deg": back.theta_rad.to_degrees(), "y_mm": mm(back.y_m), "z_mm": mm(back.z_m),
            "error_deg": off.angle_rad.to_degrees(), "error_mm": mm(off.position_m),
        })
    });
    serde_json::to_string_pretty(&json!({
        "pair": parts.name, "imprint": parts.source, "prediction": parts.prediction,
        "tool": parts.tool.map(|(name, _)| name), "engine": parts.registration.to_string(), "mask": parts.mask,
        "convention": CONVENTION, "grasp_from_object": matrix(pose.grasp_from_cad()),
        "object_from_grasp": matrix(pose.grasp_from_cad().inverse()),
        "theta_deg": back.theta_rad.to_degrees(), "y_mm": mm(back.y_m), "z_mm": mm(back.z_m), "truth": truth,
        "angle_sd_deg": pose.angle_sd_rad().map(f64::to_degrees),
        "covariance": pose.report.evidence.map(|evidence| evidence.uncertainty.covariance), "verdict": pose.verdict,
        "rms_mm": mm(pose.rms_m), "contact_points": pose.num_points, "converged": pose.converged, "stop": pose.stop,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::steps::cloud::clouds;
    use crate::steps::imprint::measured;
    use crate::steps::pose::pose;
    use glam::{DVec3, DVec4};
    use touch2touch_core::align::Ask;
    use touch2touch_core::catalog;
    use touch2touch_core::contact::threshold;
    use touch2touch_core::sim::{SimConfig, random_grasp, simulate};

    #[test]
    fn a_pair_in_files_is_the_pair() {
        let (spec, folder) = (&catalog::tools()[0], tempfile::tempdir().unwrap());
        let sample = simulate(spec, random_grasp(3), 3, &SimConfig::default());
        let imprints = measured(&sample);
        let masks = imprints.clone().map(|i| i.map(|i| threshold(&i, 0.005)));
        let clouds = clouds(&sample, &imprints.as_ref(), &masks.as_ref()).unwrap();
        // The lab's models lie 4 mm beside the grasp plane.
        let mut model = spec.mesh();
        model.vertices.iter_mut().for_each(|v| v.x -= 0.004);
        let tool = ToolModel::new(model.clone()).unwrap();
        let (registration, truth) = (Registration::default(), sample.grasp_from_object);
        let found = pose(&clouds.contact_points(), &tool, &*registration.method(), Ask::default(), truth).unwrap();
        let parts = PairParts {
            name: "a/b",
            source: ImprintSource::Measured,
            prediction: None,
            rig: &sample.rig,
            clouds: &clouds,
            mask: "threshold",
            registration,
            pose: Some(&found),
            truth,
            tool: Some(("tool", &tool)),
        };
        let files = write(&parts, &folder.path().join("new")).unwrap();
        assert!(files[1].ends_with("new/a__b.t2t.measured.pose.json"), "{files:?}");

        let all = points(&parts);
        let contact: Vec<DVec3> = all.iter().filter(|p| p.contact).map(|p| p.at).collect();
        assert_eq!(contact, clouds.contact_points());
        let near = all.iter().filter(|p| p.contact && p.distance.abs() < 0.003).count();
        // A threshold of 5 mm takes in membrane that hangs beside the tool: more than half touches it.
        assert!(near * 2 > contact.len(), "{near} of {}", contact.len());
        let header = String::from_utf8_lossy(&std::fs::read(&files[0]).unwrap()[..900]).into_owned();
        assert!(header.contains("unit meters; grasp frame") && header.contains("0 = right, 1 = left"), "{header}");

        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&files[1]).unwrap()).unwrap();
        let rows: Matrix = serde_json::from_value(json["grasp_from_object"].clone()).unwrap();
        let by_rows = |p: DVec3| {
            let column = DVec4::new(p.x, p.y, p.z, 1.0);
            DVec3::from_array([0, 1, 2].map(|i| DVec4::from_array(rows[i]).dot(column)))
        };
        assert_eq!(rows[3], [0.0, 0.0, 0.0, 1.0]);
        let truth = truth.unwrap();
        let reported = json["truth"]["theta_deg"].as_f64().unwrap();
        assert!((reported - truth.inverse().theta_rad.to_degrees()).abs() < 1e-12);
        assert!((json["truth"]["error_deg"].as_f64().unwrap() - found.error_rad.unwrap().to_degrees()).abs() < 1e-9);

        // The mesh lies where the matrix puts the model; STL has 32 bits.
        let back = stl::read(&files[2]).unwrap().mesh;
        assert_eq!(back.triangles.len(), tool.mesh.triangles.len());
        for i in 0..back.triangles.len() {
            for (found, corner) in back.corners(i).into_iter().zip(model.corners(i)) {
                assert!((found - by_rows(corner)).length() < 1e-7);
            }
        }
        // Without a pose the cloud can still be had.
        let lacking = PairParts { pose: None, ..parts };
        assert_eq!(write(&lacking, folder.path()).unwrap().len(), 1);
        assert!(points(&lacking).iter().all(|p| p.distance.is_nan()));
    }
}
