//! The resectoscope as tissue sees it: capsules that push and the loop that cuts.

use bevy::prelude::*;
use resecta_tissue::{Kerf, LoopCutter, TissueTool, ToolPart, ToolPartKind};

use crate::{InstrumentState, Resectoscope, ResectoscopeGeometry};

/// What the cutting current vaporises beyond the wire, mm. Together with the wire's 0.35 mm and what is thin beside it this is 18 to 24 % of what
/// a stroke of full depth takes (docs/accuracy/strokes.md), and 27 % in `first_cuts`, whose strokes are shallower. Prostates that were resected outside of
/// the body lost about as much: 48.7 g made 38.0 g of chips with a monopolar loop (22 %), 48.4 g made 36.2 g with a bipolar one (25 %; Khorrami
/// et al., J. Endourol. 34:671, 2020).
const VAPORISED_MM: f32 = 0.1;

/// Tissue thinner than this beside the wall of a cut vaporises, too, mm: seared from the cut through and through, it holds nothing and goes with
/// the wire and the water. Our choice within the 0.5 to 1 mm to which the bed of a cut is said to be seared. Chips are seared less deep:
/// 0.12 mm with a monopolar loop, 0.14 mm with a bipolar one (Scand. J. Urol. Nephrol. 42:265, 2008).
const SEARED_MM: f32 = 0.8;

impl ResectoscopeGeometry {
    /// The instrument's capsules in its own frame with the loop at `stroke_mm`: the sheath, and of a loop that is out the two arms,
    /// then the wire.
    ///
    /// Their order never changes, so a part can be followed from one step to the next. The arms count as sheath: they are insulated,
    /// push at all times and cut nothing.
    pub fn tool_parts(&self, stroke_mm: f32) -> Vec<ToolPart> {
        let part = |[a, b]: [Vec3; 2], diameter_mm: f32, kind| ToolPart {
            a,
            b,
            radius_mm: diameter_mm / 2.0,
            kind,
        };
        let sheath = part(self.sheath_segment(), self.sheath_diameter_mm, ToolPartKind::Sheath);
        let arms = self
            .arms(stroke_mm)
            .map(|arm| part(arm, self.arm_diameter_mm, ToolPartKind::Sheath));
        let wire = self.loop_wire(stroke_mm);
        let pieces = wire
            .windows(2)
            .map(|ends| part([ends[0], ends[1]], self.wire_diameter_mm, ToolPartKind::Loop));
        let is_out = !ResectoscopeGeometry::is_drawn_in(stroke_mm);
        let of_loop = arms.into_iter().chain(pieces).filter(|_| is_out);
        std::iter::once(sheath).chain(of_loop).collect()
    }

    /// What the cutting current vaporises around the wire: the wire's own width, and [`VAPORISED_MM`] on the side of the tissue that stays.
    fn kerf(&self) -> Kerf {
        let wire_mm = 0.5 * self.wire_diameter_mm;
        Kerf {
            outside_mm: wire_mm + VAPORISED_MM,
            inside_mm: wire_mm,
            thin_mm: SEARED_MM,
        }
    }

    /// The loop in the instrument's own frame, pulled towards the operator.
    pub fn cutter(&self, stroke_mm: f32) -> LoopCutter {
        LoopCutter {
            width_mm: self.loop_width_mm,
            depth_mm: self.loop_depth_mm,
            kerf: self.kerf(),
            centre: self.loop_centre(stroke_mm),
            travel: Vec3::Z,
            down: Vec3::NEG_Y,
        }
    }
}

impl Resectoscope {
    /// Puts the tool where the state says for the coming step. Where the step starts from is the tissue's to keep.
    ///
    /// Of two pedals at once cutting wins: a generator delivers one current, and its yellow pedal goes before the blue. A loop that
    /// is drawn in delivers none, but a step that draws it in cuts to its end: that sets a chip free at the sheath's rim.
    pub fn write_tool(&self, state: &InstrumentState, tool: &mut TissueTool) {
        let cutter = self.geometry.cutter(state.stroke_mm);
        let is_out = |cutter: &LoopCutter| !ResectoscopeGeometry::is_drawn_in(-cutter.centre.z);
        let delivers = is_out(&cutter) || tool.cutter.as_ref().is_some_and(is_out);
        tool.parts = self.geometry.tool_parts(state.stroke_mm);
        tool.cutter = Some(cutter);
        tool.pose = self.sheath_pose(state);
        tool.cutting = state.cut && delivers;
        tool.coagulating = state.coagulate && !state.cut && delivers;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_that_is_drawn_in_delivers_no_current_and_the_step_that_draws_it_in_does() {
        let scope = Resectoscope::new(Vec3::ZERO, Vec3::Z, Vec3::NEG_Y).unwrap();
        let mut tool = TissueTool::default();
        let mut cuts = |stroke_mm, cut, coagulate| {
            let state = InstrumentState {
                stroke_mm,
                cut,
                coagulate,
                ..default()
            };
            scope.write_tool(&state, &mut tool);
            (tool.cutting, tool.coagulating)
        };
        assert_eq!(cuts(0.0, true, false), (false, false));
        assert_eq!(cuts(10.0, true, true), (true, false));
        assert_eq!(cuts(0.6, true, false), (true, false));
        assert_eq!(cuts(0.2, true, false), (true, false));
        assert_eq!(cuts(0.0, true, false), (false, false));
        assert_eq!(cuts(0.0, false, true), (false, false));
        assert_eq!(cuts(5.0, false, true), (false, true));
    }
}
