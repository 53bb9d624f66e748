//! Tests in a real browser: draw small scenes on each back end and read their pixels.

use super::*;
use wasm_bindgen::JsCast;
use wasm_bindgen_test::{wasm_bindgen_test, wasm_bindgen_test_configure};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement, HtmlElement, PointerEvent, PointerEventInit};

wasm_bindgen_test_configure!(run_in_browser);

const SIDE: u32 = 240;

pub(super) fn host() -> HtmlElement {
    let document = web_sys::window().unwrap().document().unwrap();
    let host: HtmlElement = document.create_element("div").unwrap().dyn_into().unwrap();
    host.style().set_css_text(&format!("position:fixed;left:0;top:0;width:{SIDE}px;height:{SIDE}px"));
    document.body().unwrap().append_child(&host).unwrap();
    host
}

/// A board of 20 mm with a hole of 8 mm in the middle, and a line below it.
fn scene() -> Scene {
    let colour = Palette::DARK.tool(0);
    let middle =
        Disc { centre_mm: [10.0, 10.0], radius_mm: 4.0, colour, state: HoleState::Planned, order: 0 };
    let line = Line {
        a_mm: [3.0, 2.0],
        b_mm: [17.0, 2.0],
        width: Width::Mm(1.0),
        colour: Colour::rgb(0x00ff_0000),
        order: UNORDERED,
    };
    Scene {
        plate: Some(Plate { min_mm: [0.0, 0.0], max_mm: [20.0, 20.0], corner_mm: 2.0 }),
        lines: vec![line],
        discs: vec![middle],
        ..Scene::default()
    }
}

/// Paints and copies the picture at once, because the browser clears the canvas afterwards. Reads by CSS
/// pixels.
pub(super) fn at_px(view: &View) -> impl Fn([f64; 2]) -> [u8; 3] + use<> {
    view.paint();
    let canvas = view.0.borrow().canvas.clone();
    let (width, height) = (canvas.width(), canvas.height());
    let document = web_sys::window().unwrap().document().unwrap();
    let copy: HtmlCanvasElement = document.create_element("canvas").unwrap().dyn_into().unwrap();
    copy.set_width(width);
    copy.set_height(height);
    let context: CanvasRenderingContext2d = copy.get_context("2d").unwrap().unwrap().dyn_into().unwrap();
    context.draw_image_with_html_canvas_element(&canvas, 0.0, 0.0).unwrap();
    let data = context.get_image_data(0.0, 0.0, f64::from(width), f64::from(height)).unwrap().data();
    let density = f64::from(width) / view.camera().viewport_px[0];
    move |px| {
        let px = px.map(|px| (px * density) as usize);
        let at = (px[1] * width as usize + px[0]) * 4;
        [data[at], data[at + 1], data[at + 2]]
    }
}

pub(super) fn pixels(view: &View) -> impl Fn([f32; 2]) -> [u8; 3] + use<> {
    let (read, camera) = (at_px(view), view.camera());
    move |mm| read(camera.to_px(mm.map(f64::from)))
}

fn close(found: [u8; 3], wanted: Colour, what: &str) {
    let apart = (0..3).map(|k| found[k].abs_diff(wanted.0[k])).max().unwrap();
    assert!(apart <= 24, "{what}: found {found:?}, wanted {:?}", wanted.0);
}

const RIM: [f32; 2] = [13.85, 10.0];
const MIDDLE: [f32; 2] = [10.0, 10.0];

async fn draws(wanted: PainterChoice, backend: Backend) -> Vec<[u8; 3]> {
    let view = View::new(&host(), wanted, Palette::DARK).await.unwrap();
    assert_eq!(view.backend(), backend);
    view.set_scene(scene());
    view.fit();
    let palette = Palette::DARK;
    let seen = pixels(&view);
    close(seen(MIDDLE), palette.bore, "the bore is dark");
    close(seen(RIM), palette.tool(0), "the ring has the tool's colour");
    close(seen([10.0, 2.0]), Colour::rgb(0x00ff_0000), "the line");
    close(seen([5.3, 16.7]), palette.plate, "the board");
    close(seen([22.5, 22.5]), palette.background, "beside the board");
    let all = [MIDDLE, RIM, [10.0, 2.0], [5.3, 16.7], [22.5, 22.5]].map(&seen).to_vec();

    view.set_states(&[(0, HoleState::Done)]);
    close(pixels(&view)(MIDDLE), palette.done, "a drilled hole is filled");
    view.set_states(&[(0, HoleState::Planned)]);
    close(pixels(&view)(MIDDLE), palette.bore, "and empty again");
    view.set_progress(OrderProgress { discs: 1, drilling: false, lines: 0 });
    close(pixels(&view)(MIDDLE), palette.done, "progress fills it too");
    view.set_progress(OrderProgress { discs: 0, drilling: true, lines: 0 });
    close(pixels(&view)(RIM), palette.current, "the hole in work has the accent");
    assert_eq!(view.0.borrow().canvas.get_attribute("data-holes").as_deref(), Some("1"));
    assert_eq!(view.0.borrow().canvas.get_attribute("data-backend").as_deref(), Some(backend.name()));
    all
}

#[wasm_bindgen_test]
async fn all_three_painters_draw_the_same_picture() {
    let webgpu = draws(PainterChoice::WebGpu, Backend::WebGpu).await;
    let webgl2 = draws(PainterChoice::WebGl2, Backend::WebGl2).await;
    draws(PainterChoice::Flat, Backend::Flat).await;
    for (a, b) in webgpu.iter().zip(&webgl2) {
        let apart = (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap();
        assert!(apart <= 6, "{webgpu:?} and {webgl2:?} differ");
    }
}

/// The scene with a film of that colour; one opening in the upper right quarter.
fn with_film(colour: Colour) -> Scene {
    let corners_mm = vec![[12.0, 15.0], [18.0, 15.0], [18.0, 19.0], [12.0, 19.0], [30.0, 15.0], [30.0, 19.0]];
    // One opening reaches over the board's edge, and two overlap.
    let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 1, 2], [1, 4, 5], [1, 5, 2]];
    let mesh = std::sync::Arc::new(Mesh { corners_mm, triangles, rings: vec![[0, 4]] });
    let body = vec![[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 0.0], [20.0, 20.0], [0.0, 20.0]];
    let layers = vec![FilledLayer { mesh, colour, openings: true }];
    let wanted_mm = Some([[0.0, 0.0], [20.0, 20.0]]);
    Scene { plate: None, body, layers, discs: Vec::new(), wanted_mm, ..scene() }
}

#[wasm_bindgen_test]
async fn mask_film_covers_the_board_except_openings() {
    let film = Colour::rgb(0x0012_6b43);
    for wanted in [PainterChoice::WebGpu, PainterChoice::WebGl2, PainterChoice::Flat] {
        let view = View::new(&host(), wanted, Palette::DARK).await.unwrap();
        let palette = Palette::DARK;
        view.set_scene(with_film(film));
        view.fit();
        let seen = pixels(&view);
        let so = |what: &str| format!("{what}, {wanted:?}");
        close(seen([5.0, 10.0]), film, &so("covered"));
        close(seen([9.9, 10.1]), film, &so("covered where two triangles of the body meet"));
        close(seen([14.0, 17.0]), palette.plate, &so("open"));
        close(seen([17.0, 16.0]), palette.plate, &so("open twice"));
        close(seen([22.0, 17.0]), palette.background, &so("beside the board"));
        close(seen([10.0, 2.0]), Colour::rgb(0x00ff_0000), &so("what lies over it"));
        view.set_scene(with_film(film.alpha(0)));
        close(pixels(&view)([5.0, 10.0]), palette.plate, &so("a film that is not there"));
        view.set_scene(Scene { plate: scene().plate, body: Vec::new(), ..with_film(film) });
        let seen = pixels(&view);
        close(seen([5.0, 10.0]), film, &so("a board without an outline"));
        close(seen([0.15, 19.85]), palette.background, &so("its round corner"));
        close(seen([14.0, 17.0]), palette.plate, &so("open there too"));
    }
}

pub(super) async fn tick() {
    let window = web_sys::window().unwrap();
    let frame = js_sys::Promise::new(&mut |resolve, _| {
        window.request_animation_frame(&resolve).unwrap();
    });
    wasm_bindgen_futures::JsFuture::from(frame).await.unwrap();
    let later = js_sys::Promise::new(&mut |resolve, _| {
        window.set_timeout_with_callback_and_timeout_and_arguments_0(&resolve, 30).unwrap();
    });
    wasm_bindgen_futures::JsFuture::from(later).await.unwrap();
}

#[wasm_bindgen_test]
async fn lost_device_is_restored_with_the_same_picture() {
    for wanted in [PainterChoice::WebGpu, PainterChoice::WebGl2] {
        let view = View::new(&host(), wanted, Palette::DARK).await.unwrap();
        view.set_scene(scene());
        view.set_states(&[(0, HoleState::Done)]);
        view.fit();
        let _ = pixels(&view);
        let backend = view.backend();
        view.lose_device();
        for _ in 0..200 {
            tick().await;
            if view.frames().losses == 1 && view.backend() == backend {
                break;
            }
        }
        assert_eq!((view.frames().losses, view.backend()), (1, backend), "{wanted:?}");
        // A new device may need some frames before it can paint.
        let painted = view.frames().painted;
        for _ in 0..200 {
            tick().await;
            if view.frames().painted > painted {
                break;
            }
        }
        close(pixels(&view)(MIDDLE), Palette::DARK.done, "the same picture");
    }
}

fn point(view: &View, kind: &str, at_mm: [f64; 2]) {
    let [x, y] = view.camera().to_px(at_mm);
    let init = PointerEventInit::new();
    init.set_client_x(x as i32);
    init.set_client_y(y as i32);
    init.set_pointer_id(1);
    let event = PointerEvent::new_with_event_init_dict(kind, &init).unwrap();
    let canvas = view.0.borrow().canvas.clone();
    canvas.dispatch_event(&event).unwrap();
}

#[wasm_bindgen_test]
async fn press_selects_and_drag_pans() {
    let view = View::new(&host(), PainterChoice::Flat, Palette::DARK).await.unwrap();
    view.set_scene(scene());
    view.fit();
    let picked = std::rc::Rc::new(std::cell::RefCell::new(Vec::new()));
    let note = picked.clone();
    view.on_press(move |pressed| note.borrow_mut().push(pressed.disc));
    for at in [MIDDLE.map(f64::from), [1.0, 1.0]] {
        point(&view, "pointerdown", at);
        point(&view, "pointerup", at);
    }
    assert_eq!(*picked.borrow(), [Some(0), None]);

    let before = view.camera();
    point(&view, "pointerdown", [10.0, 10.0]);
    point(&view, "pointermove", [15.0, 10.0]);
    point(&view, "pointerup", [15.0, 10.0]);
    assert_eq!(picked.borrow().len(), 2, "a drag is no press");
    let moved = view.camera().centre_mm[0] - before.centre_mm[0];
    assert!((moved + 5.0).abs() < 0.2, "the board went along: {moved}");
}

#[wasm_bindgen_test]
async fn dropped_view_removes_its_canvas_and_paints_on_demand() {
    let host = host();
    let view = View::new(&host, PainterChoice::Flat, Palette::DARK).await.unwrap();
    view.set_scene(scene());
    tick().await;
    tick().await;
    let painted = view.frames().painted;
    assert!(painted >= 1);
    for _ in 0..5 {
        tick().await;
    }
    assert_eq!(view.frames().painted, painted, "nothing changed, nothing is painted");
    view.set_head(Some([1.0, 1.0]));
    view.set_head(Some([2.0, 1.0]));
    tick().await;
    tick().await;
    assert_eq!(view.frames().painted, painted + 1, "two changes, one frame");
    assert_eq!(host.child_element_count(), 1);
    drop(view);
    assert_eq!(host.child_element_count(), 0);
}

#[wasm_bindgen_test]
async fn resized_canvas_is_painted_once() {
    let host = host();
    let view = View::new(&host, PainterChoice::Flat, Palette::DARK).await.unwrap();
    view.set_scene(scene());
    for _ in 0..5 {
        tick().await;
    }
    let painted = view.frames().painted;
    host.style().set_property("width", "120px").unwrap();
    for _ in 0..5 {
        tick().await;
    }
    assert_eq!(view.camera().viewport_px[0], 120.0);
    assert_eq!(view.frames().painted, painted + 1);
}

#[wasm_bindgen_test]
async fn hidden_canvas_is_not_painted_until_shown() {
    let host = host();
    let view = View::new(&host, PainterChoice::Flat, Palette::DARK).await.unwrap();
    view.set_scene(scene());
    let shown = async |display: &str| {
        host.style().set_property("display", display).unwrap();
        for _ in 0..5 {
            tick().await;
        }
        (view.frames().painted, view.camera(), view.0.borrow().canvas.width())
    };
    let (painted, camera, width) = shown("block").await;
    assert_eq!(shown("none").await, (painted, camera, width));
    view.set_progress(OrderProgress { discs: 1, drilling: false, lines: 0 });
    assert_eq!(shown("none").await, (painted, camera, width));
    assert_eq!(view.0.borrow().canvas.get_attribute("data-done").as_deref(), Some("1"), "what it is is told");
    assert_eq!(shown("block").await, (painted + 1, camera, width), "with what came meanwhile, once");
    close(pixels(&view)(MIDDLE), Palette::DARK.done, "the hole that was drilled meanwhile");
}

#[wasm_bindgen_test]
async fn drawing_is_refitted_on_resize_until_the_first_press() {
    let view = View::new(&host(), PainterChoice::Flat, Palette::DARK).await.unwrap();
    let host = view.0.borrow().host.clone();
    let resized = |width: &str| {
        host.style().set_property("width", width).unwrap();
        view.0.borrow_mut().measure();
        view.camera().px_per_mm
    };
    view.set_strokes(true);
    view.set_scene(scene());
    view.fit();
    let (whole, narrow) = (resized("240px"), resized("120px"));
    assert!(narrow < 0.6 * whole, "{narrow} after {whole}");
    view.set_over(scene().lines);
    assert_eq!(resized("240px"), whole, "marks under the pointer are nothing drawn");
    view.set_scene(scene());
    assert_eq!(resized("120px"), whole, "an edit");
    view.fit();
    assert_eq!(view.camera().px_per_mm, narrow);
    point(&view, "pointerdown", [10.0, 10.0]);
    point(&view, "pointerup", [10.0, 10.0]);
    assert_eq!(resized("240px"), narrow, "a press");
}
