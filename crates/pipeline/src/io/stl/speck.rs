//! Specks: a few stray triangles far from the model, which would make it look a thousand times as large as it is.

use std::collections::BTreeMap;

use glam::DVec3;
use touch2touch_core::mesh::{TriMesh, triangle_area};

/// Share of the surface that a speck has at most.
const SHARE: f64 = 0.05;

/// A connected part of a mesh.
#[derive(Clone, Copy)]
struct Part {
    area: f64,
    lo: DVec3,
    hi: DVec3,
}

impl Part {
    /// Distance between the boxes of two parts.
    fn gap(&self, other: &Self) -> f64 {
        (self.lo - other.hi).max(other.lo - self.hi).max(DVec3::ZERO).length()
    }

    fn with(&self, other: &Self) -> Self {
        Self { area: self.area + other.area, lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    fn size(&self) -> f64 {
        (self.hi - self.lo).max_element()
    }
}

/// Leaves out what hardly has a surface and lies further from the rest than that is long. Returns what to say of it.
pub(super) fn leave_out(mesh: &mut TriMesh) -> Option<String> {
    let part_of = connected(mesh);
    let mut parts: BTreeMap<u32, Part> = BTreeMap::new();
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(index);
        let [lo, hi] = [corners.into_iter().reduce(DVec3::min)?, corners.into_iter().reduce(DVec3::max)?];
        let one = Part { area: triangle_area(corners), lo, hi };
        parts.entry(part_of[triangle[0] as usize]).and_modify(|part| *part = part.with(&one)).or_insert(one);
    }
    let mut rest: Vec<(u32, Part)> = parts.into_iter().collect();
    rest.sort_by(|a, b| b.1.area.total_cmp(&a.1.area));
    let mut bulk = rest.first()?.1;
    let mut kept = vec![rest.remove(0).0];
    loop {
        let (near, far): (Vec<_>, Vec<_>) = rest.into_iter().partition(|(_, part)| part.gap(&bulk) <= bulk.size());
        rest = far;
        if near.is_empty() {
            break;
        }
        // Each part that is taken in may bring the next one near.
        for (name, part) in near {
            bulk = bulk.with(&part);
            kept.push(name);
        }
    }
    let area: f64 = rest.iter().map(|(_, part)| part.area).sum();
    if rest.is_empty() || area > SHARE * bulk.area {
        return None;
    }
    let far = rest.iter().map(|(_, part)| part.gap(&bulk)).fold(0.0, f64::max);
    kept.sort_unstable();
    let before = mesh.triangles.len();
    mesh.triangles.retain(|triangle| kept.binary_search(&part_of[triangle[0] as usize]).is_ok());
    drop_unused(mesh);
    let count = before - mesh.triangles.len();
    let (s, lie) = if count == 1 { ("", "lies") } else { ("s", "lie") };
    let times = far / bulk.size();
    Some(format!("{count} triangle{s} that {lie} {times:.0} times the model's length away from it: left out"))
}

/// For each vertex the first vertex of the part that it is connected with.
fn connected(mesh: &TriMesh) -> Vec<u32> {
    let mut leader: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    fn find(leader: &mut [u32], mut at: u32) -> u32 {
        while leader[at as usize] != at {
            leader[at as usize] = leader[leader[at as usize] as usize];
            at = leader[at as usize];
        }
        at
    }
    for &[a, b, c] in &mesh.triangles {
        for other in [b, c] {
            let (a, b) = (find(&mut leader, a), find(&mut leader, other));
            leader[a.max(b) as usize] = a.min(b);
        }
    }
    (0..leader.len() as u32).map(|at| find(&mut leader, at)).collect()
}

/// Leaves out the vertices that no triangle has.
fn drop_unused(mesh: &mut TriMesh) {
    let mut place = vec![None; mesh.vertices.len()];
    let mut vertices = Vec::with_capacity(mesh.vertices.len());
    for corner in mesh.triangles.iter_mut().flatten() {
        *corner = *place[*corner as usize].get_or_insert_with(|| {
            vertices.push(mesh.vertices[*corner as usize]);
            (vertices.len() - 1) as u32
        });
    }
    mesh.vertices = vertices;
}
