//! The outer edge of a bend in a crowned bar, rounded as a ball would roll along it.
//!
//! Walls and crowns of two bars meet in an edge on the outer side. A ball of the rounding's radius that touches both from
//! inside keeps its center on a curve (the spine): straight up at the walls, then over to the point where both crowns'
//! axes meet. The lab's `pattern_32`, `33` and `35` are rounded so, by 5 mm.

use glam::DVec2;

/// Places this close to an edge lie on the part, meters: vertices of the mesh are rounded.
pub(super) const TOUCH_M: f64 = 1e-9;

/// A rounded bend.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bend {
    pub(super) at: DVec2,
    /// Directions from the bend along both bars, and out of the bend between them.
    arms: [DVec2; 2],
    outwards: DVec2,
    /// Sine and tangent of half the angle between the bars.
    sin: f64,
    tan: f64,
    half_width_m: f64,
    pub(super) radius_m: f64,
}

impl Bend {
    /// The bend at the middle one of three points of a path.
    pub(super) fn new([before, at, after]: [DVec2; 3], half_width_m: f64, radius_m: f64) -> Self {
        let arms = [before - at, after - at].map(|arm| arm.normalize_or(DVec2::X));
        let outwards = -(arms[0] + arms[1]).normalize_or(arms[0].perp());
        let cos = -outwards.dot(arms[0]);
        let sin = (1.0 - cos * cos).max(1e-12).sqrt();
        Self { at, arms, outwards, sin, tan: sin / cos.max(1e-6), half_width_m, radius_m: radius_m.min(half_width_m) }
    }

    /// Center of the rounding of the walls, (y, z).
    pub(super) fn center(&self) -> DVec2 {
        self.at + self.outwards * (self.slack() / self.sin)
    }

    /// Distance between the ball's center and the axes of the crowns it touches.
    fn slack(&self) -> f64 {
        self.half_width_m - self.radius_m
    }

    /// True where the surface over `p` is that of the rounding.
    pub(super) fn rounds(&self, p: DVec2) -> bool {
        let p = p - self.at;
        if p.dot(self.outwards) <= 0.0 {
            return false;
        }
        let [a, b] = self.arms;
        let nearer = if p.dot(a) > p.dot(b) { a } else { b };
        p.dot(nearer) * self.half_width_m * self.tan < -nearer.perp_dot(p).abs() * self.slack()
    }

    /// Directions from the bend along which the ball touches the crowns.
    pub(super) fn contacts(&self) -> [DVec2; 2] {
        let across = |arm: DVec2| if arm.perp_dot(self.outwards) > 0.0 { arm.perp() } else { -arm.perp() };
        self.arms.map(|arm| across(arm) * self.half_width_m * self.tan - arm * self.slack())
    }

    /// Distance to the outline, meters, negative inside, where it is rounded.
    pub(super) fn outline_distance(&self, p: DVec2) -> f64 {
        let along = (p - self.at).dot(self.outwards).clamp(0.0, self.slack() / self.sin);
        (p - self.at - self.outwards * along).length() - self.radius_m
    }

    /// Point of the spine: its (y, z) and its height over the crowns' axes; `turn` is 0 over the bend and a quarter turn at the
    /// walls.
    fn spine(&self, turn: f64) -> (DVec2, f64) {
        let (sin, cos) = turn.sin_cos();
        (self.at + self.outwards * (self.slack() * sin / self.sin), self.slack() * cos)
    }

    /// Height at `p` over the middle plane; the crowns' axes lie at `axis_m`. `None` beside the tool.
    pub(super) fn height(&self, p: DVec2, axis_m: f64) -> Option<f64> {
        if self.outline_distance(p) > TOUCH_M {
            return None;
        }
        let square = self.radius_m * self.radius_m;
        let height = |turn: f64| {
            let (center, height) = self.spine(turn);
            let room = square - (p - center).length_squared();
            if room < 0.0 { room } else { height + room.sqrt() }
        };
        Some(axis_m + height(least(|turn| -height(turn))).max(0.0))
    }

    /// Distance of the point `h` over the middle plane at `p` to the rounded solid, meters, negative inside.
    pub(super) fn distance(&self, p: DVec2, h: f64, axis_m: f64) -> f64 {
        let distance = |turn: f64| {
            let (center, height) = self.spine(turn);
            // All below the ball is solid.
            (p - center).length().hypot((h - axis_m - height).max(0.0))
        };
        distance(least(distance)) - self.radius_m
    }
}

/// Place of the least value over a quarter turn of a function that falls and then rises.
fn least(f: impl Fn(f64) -> f64) -> f64 {
    const SHARE: f64 = 0.618_033_988_749_894_8;
    let (mut low, mut high) = (0.0, std::f64::consts::FRAC_PI_2);
    let (mut a, mut b) = (high - SHARE * (high - low), low + SHARE * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..40 {
        if fa < fb {
            (high, b, fb) = (b, a, fa);
            a = high - SHARE * (high - low);
            fa = f(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + SHARE * (high - low);
            fb = f(b);
        }
    }
    0.5 * (low + high)
}
