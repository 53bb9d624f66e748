//! The camera of the 2D view: the board position in the middle of the window, and the scale.
//!
//! ```text
//!  px (0,0) ┌────────────┐      Y of the board points up, y of the window down
//!           │      + centre_mm
//!           └────────────┘ viewport_px
//! ```

/// CSS pixels per millimetre at 100 %: 96 per inch, by definition of CSS.
const ACTUAL_PX_PER_MM: f64 = 96.0 / 25.4;
/// A board of 10 m still fits a window.
const LOWEST_PX_PER_MM: f64 = 0.05;
/// 0.25 µm per pixel.
const HIGHEST_PX_PER_MM: f64 = 4000.0;
const MOST_RULER_MARKS: u16 = 100;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub centre_mm: [f64; 2],
    pub px_per_mm: f64,
    pub viewport_px: [f64; 2],
    /// Seen from below: X points left.
    pub mirrored: bool,
}

impl Default for Camera {
    fn default() -> Self {
        Self { centre_mm: [0.0; 2], px_per_mm: ACTUAL_PX_PER_MM, viewport_px: [1.0; 2], mirrored: false }
    }
}

impl Camera {
    /// The sign of X on screen: 1 to the right, -1 to the left.
    pub fn hand(&self) -> f64 {
        if self.mirrored { -1.0 } else { 1.0 }
    }

    pub fn to_px(&self, mm: [f64; 2]) -> [f64; 2] {
        [
            self.viewport_px[0] / 2.0 + (mm[0] - self.centre_mm[0]) * self.px_per_mm * self.hand(),
            self.viewport_px[1] / 2.0 - (mm[1] - self.centre_mm[1]) * self.px_per_mm,
        ]
    }

    pub fn to_mm(&self, px: [f64; 2]) -> [f64; 2] {
        [
            self.centre_mm[0] + (px[0] - self.viewport_px[0] / 2.0) / self.px_per_mm * self.hand(),
            self.centre_mm[1] - (px[1] - self.viewport_px[1] / 2.0) / self.px_per_mm,
        ]
    }

    pub fn pan_px(&mut self, by_px: [f64; 2]) {
        self.centre_mm[0] -= by_px[0] / self.px_per_mm * self.hand();
        self.centre_mm[1] += by_px[1] / self.px_per_mm;
    }

    /// Zooms by `factor`; the position under `at_px` doesn't move.
    pub fn zoom_at(&mut self, at_px: [f64; 2], factor: f64) {
        let fixed = self.to_mm(at_px);
        self.set_zoom(self.px_per_mm * factor);
        let moved = self.to_mm(at_px);
        self.centre_mm[0] += fixed[0] - moved[0];
        self.centre_mm[1] += fixed[1] - moved[1];
    }

    pub fn set_zoom(&mut self, px_per_mm: f64) {
        if px_per_mm.is_finite() {
            self.px_per_mm = px_per_mm.clamp(LOWEST_PX_PER_MM, HIGHEST_PX_PER_MM);
        }
    }

    pub fn fit(&mut self, bounds_mm: [[f64; 2]; 2], margin_px: f64) {
        let [low, high] = bounds_mm;
        let room =
            |axis: usize| (self.viewport_px[axis] - 2.0 * margin_px).max(self.viewport_px[axis] * 0.25);
        let zoom = |axis: usize| room(axis) / (high[axis] - low[axis]).max(0.5);
        self.centre_mm = [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0];
        self.set_zoom(zoom(0).min(zoom(1)));
    }

    /// The multiples of `step_mm` in view along an axis: pixel position and value in mm. `from_mm` is the
    /// value at the picture's origin.
    pub fn ruler(&self, axis: usize, from_mm: f64, step_mm: f64) -> Vec<(f64, f64)> {
        let ends = [[0.0; 2], self.viewport_px].map(|corner| self.to_mm(corner)[axis] + from_mm);
        let first = libm::ceil(ends[0].min(ends[1]) / step_mm);
        let all = (0..MOST_RULER_MARKS).map(|count| (first + f64::from(count)) * step_mm);
        let seen = all.take_while(|called| *called <= ends[0].max(ends[1]));
        let place = |called: f64| {
            let mut at_mm = [0.0; 2];
            at_mm[axis] = called - from_mm;
            (self.to_px(at_mm)[axis], called + 0.0)
        };
        seen.map(place).collect()
    }

    /// 1 means actual size on a screen of 96 pixels per inch.
    pub fn zoom(&self) -> f64 {
        self.px_per_mm / ACTUAL_PX_PER_MM
    }

    /// The grid step in mm (the smallest power of ten at least 10 pixels wide), and its opacity from 0 to 1.
    pub fn grid(&self) -> (f64, f64) {
        let exponent = libm::ceil(libm::log10(10.0 / self.px_per_mm));
        let step = libm::pow(10.0, exponent);
        let spacing_px = step * self.px_per_mm;
        (step, ((spacing_px - 10.0) / 40.0).clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window() -> Camera {
        Camera { viewport_px: [800.0, 600.0], ..Camera::default() }
    }

    fn near(a: [f64; 2], b: [f64; 2]) {
        assert!((a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6, "{a:?} is not {b:?}");
    }

    #[test]
    fn pixel_and_millimetre_conversions_are_inverse() {
        let camera = Camera { centre_mm: [10.0, -4.0], px_per_mm: 20.0, ..window() };
        near(camera.to_px([10.0, -4.0]), [400.0, 300.0]);
        near(camera.to_px([11.0, -3.0]), [420.0, 280.0]);
        let below = Camera { mirrored: true, ..camera };
        near(below.to_px([11.0, -3.0]), [380.0, 280.0]);
        for px in [[0.0, 0.0], [800.0, 600.0], [17.0, 555.0]] {
            near(camera.to_px(camera.to_mm(px)), px);
            near(below.to_px(below.to_mm(px)), px);
        }
    }

    #[test]
    fn zoom_fixes_the_point_under_the_cursor_even_at_its_limits() {
        for factor in [1.25, 0.5, 1e9, 1e-9] {
            let mut camera = Camera { centre_mm: [3.0, 7.0], ..window() };
            let fixed = camera.to_mm([120.0, 80.0]);
            camera.zoom_at([120.0, 80.0], factor);
            near(camera.to_mm([120.0, 80.0]), fixed);
            assert!(camera.px_per_mm >= LOWEST_PX_PER_MM && camera.px_per_mm <= HIGHEST_PX_PER_MM);
        }
    }

    #[test]
    fn panning_moves_the_board_with_the_pointer() {
        for mirrored in [false, true] {
            let mut camera = Camera { mirrored, ..window() };
            let held = camera.to_mm([100.0, 100.0]);
            camera.pan_px([40.0, -25.0]);
            near(camera.to_mm([140.0, 75.0]), held);
        }
    }

    #[test]
    fn fitting_shows_the_whole_box_within_the_margin() {
        let rows = [
            [[0.0, 0.0], [100.0, 80.0]],
            [[-500.0, 3.0], [500.0, 4.0]],
            [[5.0, 5.0], [5.0, 5.0]],
            [[0.0, 0.0], [0.1, 90.0]],
        ];
        for bounds in rows {
            let mut camera = window();
            camera.fit(bounds, 40.0);
            let low = camera.to_px(bounds[0]);
            let high = camera.to_px(bounds[1]);
            assert!(low[0] >= 39.999 && high[0] <= 760.001, "{bounds:?}: {low:?} {high:?}");
            assert!(high[1] >= 39.999 && low[1] <= 560.001, "{bounds:?}: {low:?} {high:?}");
        }
        let mut tiny = Camera { viewport_px: [30.0, 30.0], ..Camera::default() };
        tiny.fit([[0.0, 0.0], [10.0, 10.0]], 40.0);
        assert!(tiny.px_per_mm > 0.0 && tiny.px_per_mm.is_finite());
    }

    #[test]
    fn ruler_counts_from_its_zero_and_is_mirrored_from_below() {
        let camera = Camera { centre_mm: [10.0, 0.0], px_per_mm: 40.0, ..window() };
        let along = camera.ruler(0, -2.0, 5.0);
        assert_eq!(along, [(80.0, 0.0), (280.0, 5.0), (480.0, 10.0), (680.0, 15.0)]);
        let up = camera.ruler(1, 0.0, 5.0);
        assert_eq!(up, [(500.0, -5.0), (300.0, 0.0), (100.0, 5.0)]);
        let below = Camera { mirrored: true, ..camera }.ruler(0, -2.0, 5.0);
        assert_eq!(below.first(), Some(&(720.0, 0.0)));
        assert!(camera.ruler(0, 0.0, 1e-9).len() <= usize::from(MOST_RULER_MARKS));
    }

    #[test]
    fn grid_step_is_between_10_and_100_pixels() {
        for zoom in [0.06, 0.5, 3.0, 9.99, 10.0, 47.0, 3999.0] {
            let mut camera = window();
            camera.set_zoom(zoom);
            let (step, faded) = camera.grid();
            let px = step * camera.px_per_mm;
            assert!((9.999..100.001).contains(&px), "{zoom}: {px}");
            assert!((0.0..=1.0).contains(&faded));
        }
    }

    #[test]
    fn invalid_zoom_changes_nothing() {
        let mut camera = window();
        camera.set_zoom(f64::NAN);
        assert_eq!(camera, window());
    }
}
