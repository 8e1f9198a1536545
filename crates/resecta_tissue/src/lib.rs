//! Soft tissue for Bevy that deforms, collides and can be cut.
