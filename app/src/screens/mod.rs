//! What people see. For now the picture alone.

use crate::picture;
use crate::view::{Palette, View, Wanted};
use annulus_core::board::Board;
use leptos::html::Div;
use leptos::prelude::*;

/// The whole page.
#[component]
pub fn App() -> impl IntoView {
    let host = NodeRef::<Div>::new();
    let shown = StoredValue::new_local(None::<View>);
    host.on_load(move |host| {
        leptos::task::spawn_local(async move {
            if let Ok(view) = View::new(&host, Wanted::Auto, Palette::DARK).await {
                view.set_scene(picture::scene(&Board::default(), &Palette::DARK));
                shown.set_value(Some(view));
            }
        });
    });
    view! { <div class="picture" node_ref=host></div> }
}
