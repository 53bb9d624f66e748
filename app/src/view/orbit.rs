//! The camera of the 3D view: a board position in the middle of the window, two angles, and the visible
//! extent.
//!
//! ```text
//!        eye ●            tilt 90° is straight from above, below 0° from underneath
//!             ╲ tilt      turn 0° has X to the right
//!   ───────────●──────── centre, on the surface
//! ```

/// Half the vertical angle of view.
const HALF_VIEW_RAD: f64 = 0.2;
/// Minimum and maximum of [`Orbit::across_mm`].
const ACROSS_MM: [f64; 2] = [0.2, 5_000.0];
const HOME_DEG: [f64; 2] = [52.0, -18.0];
/// At a flatter tilt the board would be only a line.
const LEAST_TILT_DEG: f64 = 8.0;
/// Maximum share of the window for a fitted board.
const FITTED_SHARE: f64 = 0.86;
/// Degrees per pixel of a drag.
const DEG_PER_PX: f64 = 0.35;

/// A point in mm: X right, Y up the board, Z out of the board.
pub(super) type Spot = [f64; 3];

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    pub centre_mm: [f64; 2],
    /// From 90, straight down, to −90, straight up from underneath.
    pub tilt_deg: f64,
    /// About the vertical axis.
    pub turn_deg: f64,
    pub across_mm: f64,
}

/// The rays of a window: from `eye` along `forward` + x · `right` + y · `up`, x and y from −1 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rays {
    pub eye: Spot,
    /// Through the middle of the window.
    pub forward: Spot,
    /// From the middle to the right edge.
    pub right: Spot,
    pub up: Spot,
}

impl Default for Orbit {
    fn default() -> Self {
        let [tilt_deg, turn_deg] = HOME_DEG;
        Self { centre_mm: [0.0; 2], tilt_deg, turn_deg, across_mm: 100.0 }
    }
}

fn scaled(spot: Spot, by: f64) -> Spot {
    spot.map(|part| part * by)
}

fn dot(a: Spot, b: Spot) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Spot, b: Spot) -> Spot {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

impl Orbit {
    /// The whole box in the initial view, or straight from above if `flat`.
    pub fn of(bounds_mm: [[f64; 2]; 2], viewport_px: [f64; 2], flat: bool) -> Self {
        let mut orbit = Self::default();
        if flat {
            (orbit.tilt_deg, orbit.turn_deg) = (90.0, 0.0);
        }
        orbit.fit(bounds_mm, viewport_px);
        orbit
    }

    /// Fits the whole box from the current direction: as far away as needed so that no corner gets too close
    /// to the window's edge.
    pub fn fit(&mut self, bounds_mm: [[f64; 2]; 2], viewport_px: [f64; 2]) {
        let [low, high] = bounds_mm;
        self.centre_mm = [0, 1].map(|axis| (low[axis] + high[axis]) / 2.0);
        let rays = self.rays(viewport_px);
        let least_mm = |corner: [f64; 2]| {
            let off = [corner[0] - self.centre_mm[0], corner[1] - self.centre_mm[1], 0.0];
            let across = [rays.right, rays.up].map(|edge| (dot(off, edge) / dot(edge, edge)).abs());
            across[0].max(across[1]) / FITTED_SHARE - dot(off, rays.forward)
        };
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
        let away_mm = corners.map(least_mm).into_iter().fold(0.0, f64::max);
        self.set_across((2.0 * libm::tan(HALF_VIEW_RAD) * away_mm).max(1.0));
    }

    pub fn is_below(&self) -> bool {
        self.tilt_deg < 0.0
    }

    pub fn flip(&mut self) {
        self.tilt_deg = -self.tilt_deg;
    }

    pub fn turn_px(&mut self, by_px: [f64; 2]) {
        self.turn_deg = (self.turn_deg + by_px[0] * DEG_PER_PX).rem_euclid(360.0);
        let tilt = self.tilt_deg + by_px[1] * DEG_PER_PX;
        let (low, high) = if self.is_below() { (-90.0, -LEAST_TILT_DEG) } else { (LEAST_TILT_DEG, 90.0) };
        self.tilt_deg = tilt.clamp(low, high);
    }

    /// Pans by a drag of pixels; the board follows the pointer.
    pub fn pan_px(&mut self, from_px: [f64; 2], to_px: [f64; 2], viewport_px: [f64; 2]) {
        let places = [from_px, to_px].map(|at| self.to_mm(at, viewport_px));
        if let [Some(from), Some(to)] = places {
            self.centre_mm = [0, 1].map(|axis| self.centre_mm[axis] + from[axis] - to[axis]);
        }
    }

    /// Zooms by `factor`; the position under `at_px` doesn't move.
    pub fn zoom_at(&mut self, at_px: [f64; 2], factor: f64, viewport_px: [f64; 2]) {
        let before = self.to_mm(at_px, viewport_px);
        self.set_across(self.across_mm / factor);
        if let (Some(before), Some(after)) = (before, self.to_mm(at_px, viewport_px)) {
            self.centre_mm = [0, 1].map(|axis| self.centre_mm[axis] + before[axis] - after[axis]);
        }
    }

    fn set_across(&mut self, across_mm: f64) {
        if across_mm.is_finite() {
            self.across_mm = across_mm.clamp(ACROSS_MM[0], ACROSS_MM[1]);
        }
    }

    pub fn rays(&self, viewport_px: [f64; 2]) -> Rays {
        let (tilt, turn) = (self.tilt_deg.to_radians(), self.turn_deg.to_radians());
        let half = libm::tan(HALF_VIEW_RAD);
        let away_mm = self.across_mm / 2.0 / half;
        let (level, high) = (libm::cos(tilt), libm::sin(tilt));
        let (sine, cosine) = (libm::sin(turn), libm::cos(turn));
        let back = [-sine * level, -cosine * level, high];
        let right = if self.is_below() { [-cosine, sine, 0.0] } else { [cosine, -sine, 0.0] };
        let forward = scaled(back, -1.0);
        let up = cross(right, forward);
        let eye =
            [self.centre_mm[0] + back[0] * away_mm, self.centre_mm[1] + back[1] * away_mm, back[2] * away_mm];
        let aspect = viewport_px[0] / viewport_px[1].max(1.0);
        Rays { eye, forward, right: scaled(right, half * aspect), up: scaled(up, half) }
    }

    /// The point of the surface under a pixel; none beyond the horizon.
    pub fn to_mm(&self, px: [f64; 2], viewport_px: [f64; 2]) -> Option<[f64; 2]> {
        let rays = self.rays(viewport_px);
        let x = 2.0 * px[0] / viewport_px[0].max(1.0) - 1.0;
        let y = 1.0 - 2.0 * px[1] / viewport_px[1].max(1.0);
        let way: Spot =
            std::array::from_fn(|axis| rays.forward[axis] + x * rays.right[axis] + y * rays.up[axis]);
        let far = -rays.eye[2] / way[2];
        (far.is_finite() && far > 0.0).then(|| [0, 1].map(|axis| rays.eye[axis] + far * way[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW_PX: [f64; 2] = [800.0, 600.0];

    fn views() -> Vec<Orbit> {
        let of = |tilt_deg, turn_deg| Orbit { tilt_deg, turn_deg, centre_mm: [10.0, 5.0], across_mm: 40.0 };
        vec![of(90.0, 0.0), of(50.0, -20.0), of(20.0, 130.0), of(-60.0, 40.0), of(-90.0, 0.0)]
    }

    fn near(a: [f64; 2], b: [f64; 2]) {
        assert!((a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6, "{a:?} is not {b:?}");
    }

    #[test]
    fn orbit_zoom_and_pan_fix_the_point_under_the_pointer() {
        for mut orbit in views() {
            near(orbit.to_mm([400.0, 300.0], WINDOW_PX).unwrap(), orbit.centre_mm);
            let held = orbit.to_mm([300.0, 350.0], WINDOW_PX).unwrap();
            orbit.zoom_at([300.0, 350.0], 1.7, WINDOW_PX);
            near(orbit.to_mm([300.0, 350.0], WINDOW_PX).unwrap(), held);
            orbit.pan_px([300.0, 350.0], [340.0, 300.0], WINDOW_PX);
            near(orbit.to_mm([340.0, 300.0], WINDOW_PX).unwrap(), held);
        }
    }

    #[test]
    fn x_points_right_from_above_and_left_from_below() {
        let [above, .., below] = <[Orbit; 5]>::try_from(views()).unwrap();
        let right = |orbit: Orbit| orbit.to_mm([500.0, 300.0], WINDOW_PX).unwrap();
        let up = |orbit: Orbit| orbit.to_mm([400.0, 200.0], WINDOW_PX).unwrap();
        assert!(right(above)[0] > 10.0 && up(above)[1] > 5.0);
        assert!(right(below)[0] < 10.0 && up(below)[1] > 5.0, "{:?}", up(below));
    }

    fn seen(orbit: &Orbit, at_mm: [f64; 2], window: [f64; 2]) -> [f64; 2] {
        let rays = orbit.rays(window);
        let way = [at_mm[0] - rays.eye[0], at_mm[1] - rays.eye[1], -rays.eye[2]];
        [rays.right, rays.up].map(|edge| dot(way, edge) / dot(edge, edge) / dot(way, rays.forward))
    }

    #[test]
    fn fitted_board_fills_every_window_from_every_side() {
        for (width, height) in [(1100.0, 600.0), (390.0, 420.0), (200.0, 900.0), (2000.0, 150.0)] {
            for (wide, tall) in [(40.0, 30.0), (300.0, 20.0), (20.0, 300.0)] {
                for mut orbit in views().into_iter().chain([Orbit::default()]) {
                    let (low, high) = ([5.0, -7.0], [5.0 + wide, -7.0 + tall]);
                    orbit.fit([low, high], [width, height]);
                    let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
                    let all = corners.map(|corner| seen(&orbit, corner, [width, height]));
                    let most = all.iter().flatten().fold(0.0_f64, |most, part| most.max(part.abs()));
                    assert!((most - FITTED_SHARE).abs() < 1e-9, "{most} of {orbit:?} in {width} × {height}");
                }
            }
        }
    }

    #[test]
    fn fitted_box_is_visible_and_drags_stop_at_the_horizon() {
        let box_mm = [[0.0, 0.0], [100.0, 60.0]];
        let orbit = Orbit::of(box_mm, WINDOW_PX, true);
        let corner = orbit.to_mm([0.0, 600.0], WINDOW_PX).unwrap();
        assert!(corner[0] < 0.0 && corner[1] < 0.0, "{corner:?}");
        for mut orbit in views() {
            let below = orbit.is_below();
            orbit.turn_px([0.0, 9_000.0]);
            orbit.turn_px([0.0, -9_000.0]);
            assert_eq!((orbit.is_below(), orbit.to_mm([400.0, 300.0], WINDOW_PX).is_some()), (below, true));
            orbit.flip();
            assert_eq!(orbit.is_below(), !below);
        }
    }
}
