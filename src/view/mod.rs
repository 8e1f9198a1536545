//! What is seen: the endoscope's round field, the outside view of the gland, and pictures of both without a window.
//!
//! [`ViewPlugin`] dresses what `resecta_scenario` spawns: materials and marks on the gland, a body for the instrument,
//! bladder, urethra and landmarks around them. It moves every camera that is an [`EndoscopeCamera`] or an
//! [`OutsideCamera`] and spawns none itself: the game gives them a window ([`crate::game`]), [`PicturesPlugin`] images.
//!
//! Everything wears one material with one shader (`material.rs`, `vertex.wgsl`, `view.wgsl`) that brings its own light: the only
//! lamp of an endoscopy sits beside the lens, so that a general lighting model would cost much and add nothing, and the
//! program stays usable on a software renderer.
//!
//! | to find | look in |
//! |---|---|
//! | what is drawn between two steps | `between.rs` |
//! | where a camera stands and what it sees | `cameras.rs` |
//! | blood in the water, on the lens and on vessels; jets | `blood.rs`, `jets.rs` |
//! | what strokes cut free | `chips.rs` |
//! | sparks, glow and bubbles at the wire | `sparks.rs` |
//! | the round field, and how a telescope bends the picture | `round_field.rs`, `round_field.wgsl` |
//! | what a lens sees that is pressed on tissue | `veil.rs` |
//! | colours of the gland, the marked part | `gland.rs` |
//! | the verumontanum as a mound | `mound.rs` |
//! | the section of the outside view | `sections.rs` |
//! | the instrument's body, and the ghost of another run's | `instrument.rs` |
//! | bladder, urethra, landmarks | `surroundings.rs` |
//! | pictures as files | `pictures.rs` |

mod adapter;
mod between;
mod blood;
mod cameras;
mod chips;
mod gland;
mod instrument;
mod jets;
mod material;
mod mound;
mod palette;
mod pictures;
mod round_field;
mod sections;
mod shapes;
mod sparks;
mod surroundings;
mod veil;

use bevy::{camera::visibility::RenderLayers, prelude::*};

pub use adapter::{NoAdapter, adapter_available};
pub use between::DrawBetweenSteps;
pub use cameras::{EndoscopeCamera, OutsideCamera, endoscope_camera, outside_camera};
pub use instrument::Ghost;
pub use material::{Anatomy, Cover, Look, Surface, ViewMaterial};
pub use pictures::{PICTURE_SIZE, PictureError, Pictures, PicturesPlugin, finish_pictures};
pub(crate) use pictures::{png_of, save_picture};
pub use round_field::Fineness;
pub(crate) use round_field::shown_at;
pub use surroundings::LandmarkMarker;
pub(crate) use veil::{PICTURE_WAITS_S, Veil};

/// What only the endoscope shows.
const ENDOSCOPE_LAYER: usize = 1;
/// What only the outside view shows.
const OUTSIDE_LAYER: usize = 2;

/// The layers of what both views show alike.
fn both_layers() -> RenderLayers {
    RenderLayers::from_layers(&[ENDOSCOPE_LAYER, OUTSIDE_LAYER])
}

/// What runs in a frame, in this order, in `Update`: after the frame's fixed steps, before transforms are propagated.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ViewSystems {
    /// Empty: for systems that turn the outside view or switch cameras on and off.
    First,
    /// New glands, instruments and exercises get what makes them visible.
    Dress,
    /// Instruments are put where they are drawn.
    Place,
    /// Cameras and moving parts follow the instrument.
    Follow,
    /// Empty: for systems that come after the views.
    Last,
}

/// Makes an exercise visible. Needs Bevy's renderer; without cameras it shows nothing.
#[derive(Debug, Default, Clone, Copy)]
pub struct ViewPlugin;

impl Plugin for ViewPlugin {
    fn build(&self, app: &mut App) {
        app.configure_sets(
            Update,
            (
                ViewSystems::First,
                ViewSystems::Dress,
                ViewSystems::Place,
                ViewSystems::Follow,
                ViewSystems::Last,
            )
                .chain(),
        );
        app.add_plugins((
            material::plugin,
            between::plugin,
            blood::plugin,
            jets::plugin,
            chips::plugin,
            sparks::plugin,
            cameras::plugin,
            veil::plugin,
            round_field::plugin,
            gland::plugin,
            mound::plugin,
            sections::plugin,
            instrument::plugin,
            surroundings::plugin,
        ));
    }
}
