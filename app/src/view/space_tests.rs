//! Tests of the 3D view in a real browser: draws a small carved field on both back ends, from above and
//! obliquely, and compares pixels with depths; again after the device was lost.

use super::browser_tests::{host, pixels};
use super::*;
use wasm_bindgen_test::wasm_bindgen_test;

/// Depth of a board of 12.8 mm, in µm: a groove of 0.2 mm, a hole, a scratch in the copper.
fn depth_um(x: f32, y: f32) -> u16 {
    let away = ((x - 9.0) * (x - 9.0) + (y - 9.0) * (y - 9.0)).sqrt();
    match () {
        () if away < 1.5 => 2_000,
        () if (2.0..4.0).contains(&x) => 200,
        () if (6.0..7.0).contains(&x) && y < 4.0 => 10,
        () => 0,
    }
}

fn relief() -> Relief {
    Relief {
        low_mm: [0.0, 0.0],
        cell_mm: 0.1,
        cells: [128, 128],
        thickness_mm: 1.6,
        copper_mm: 0.035,
        both_sides: false,
    }
}

fn patches() -> Vec<Patch> {
    let tile = |first: [usize; 2]| {
        let cell = |index: usize| [first[0] + index % PATCH, first[1] + index / PATCH];
        let depth = |[x, y]: [usize; 2]| depth_um((x as f32 + 0.5) * 0.1, (y as f32 + 0.5) * 0.1);
        let depths: Vec<u16> = (0..PATCH * PATCH).map(|index| depth(cell(index))).collect();
        Patch { first, depths_um: Some(depths.into()) }
    };
    [[0, 0], [64, 0], [0, 64], [64, 64]].map(tile).into()
}

/// The material by colour: copper is red, laminate as green as red; through a hole the dark blue ground is
/// visible.
fn kind([red, green, blue]: [u8; 3]) -> &'static str {
    let [red, green, blue] = [red, green, blue].map(i32::from);
    match () {
        () if red > green + green / 3 && red > 60 => "copper",
        () if green > blue + 15 && red - green < 60 => "laminate",
        () => "ground",
    }
}

async fn view(wanted: PainterChoice) -> View {
    let view = View::new(&host(), wanted, Palette::DARK).await.unwrap();
    view.set_relief(Some(relief()));
    view.patch(&patches());
    view.show_solid(true);
    view.look_home(true);
    view
}

fn seen(view: &View) -> Vec<(&'static str, u16)> {
    let _ = pixels(view);
    let read = super::browser_tests::at_px(view);
    let places = [[1.0, 6.0], [3.0, 6.0], [9.0, 9.0], [5.5, 10.0], [3.0, 11.5], [11.5, 2.0], [6.5, 2.0]];
    let stage = view.0.borrow();
    let (orbit, window) = (stage.solid.orbit, stage.camera.viewport_px);
    places
        .map(|place: [f32; 2]| {
            // The pixel of the position: the view from above scales linearly from the middle.
            let off = [0, 1].map(|axis| f64::from(place[axis]) - orbit.centre_mm[axis]);
            let scale = window[1] / orbit.across_mm;
            let px = [window[0] / 2.0 + off[0] * scale, window[1] / 2.0 - off[1] * scale];
            (kind(read(px)), depth_um(place[0], place[1]))
        })
        .into()
}

fn expected(depth_um: u16) -> &'static str {
    match depth_um {
        0..=34 => "copper",
        35..=1_599 => "laminate",
        _ => "ground",
    }
}

#[wasm_bindgen_test]
async fn carved_depths_are_drawn_on_both_gpu_backends() {
    for wanted in [PainterChoice::WebGpu, PainterChoice::WebGl2] {
        let view = view(wanted).await;
        for (found, depth) in seen(&view) {
            assert_eq!(found, expected(depth), "{depth} µm on {wanted:?}");
        }
        view.look_flipped();
        let orbit = view.0.borrow().solid.orbit;
        assert!(orbit.is_below());
        let read = super::browser_tests::at_px(&view);
        assert_eq!(kind(read([120.0, 120.0])), "laminate", "the underside has no copper");
        view.look_flipped();
        view.lose_device();
        for _ in 0..200 {
            super::browser_tests::tick().await;
            if view.frames().losses == 1 && view.backend() != Backend::Flat {
                break;
            }
        }
        for (found, depth) in seen(&view) {
            assert_eq!(found, expected(depth), "{depth} µm after the loss on {wanted:?}");
        }
    }
}

#[wasm_bindgen_test]
async fn flat_painter_draws_no_3d_view() {
    let view = view(PainterChoice::Flat).await;
    assert_eq!(view.backend(), Backend::Flat);
    let _ = pixels(&view);
    let canvas = view.0.borrow().canvas.clone();
    assert_eq!(canvas.get_attribute("data-solid").as_deref(), Some(""));
}

#[wasm_bindgen_test]
async fn board_is_refitted_on_resize_until_the_user_moves_it() {
    let view = view(PainterChoice::WebGl2).await;
    view.look_home(false);
    let host = view.0.borrow().host.clone();
    let resized = |width: &str| {
        host.style().set_property("width", width).unwrap();
        view.0.borrow_mut().measure();
        view.0.borrow().solid.orbit
    };
    let (home, narrow) = (resized("240px"), resized("120px"));
    assert!(narrow.across_mm > 1.7 * home.across_mm, "{narrow:?} after {home:?}");
    assert_eq!([narrow.tilt_deg, narrow.turn_deg], [home.tilt_deg, home.turn_deg]);
    assert_eq!(resized("240px"), home);
    view.zoom_by(2.0);
    let near = resized("240px");
    assert_eq!(resized("120px"), near, "what somebody has moved stays as it was put");
}
