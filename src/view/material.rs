//! The one material of the views: the numbers that its shader, `view.wgsl`, works with.

use bevy::{
    asset::embedded_asset,
    math::{DVec2, DVec3, DVec4},
    mesh::MeshVertexBufferLayoutRef,
    pbr::{MaterialPipeline, MaterialPipelineKey},
    prelude::*,
    reflect::TypePath,
    render::render_resource::{
        AsBindGroup, CompareFunction, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError,
    },
    shader::{ShaderDefVal, ShaderRef, load_shader_library},
};
use resecta_anatomy::{BladderShape, Case, Landmark};

pub fn plugin(app: &mut App) {
    load_shader_library!(app, "noise.wgsl");
    embedded_asset!(app, "vertex.wgsl");
    embedded_asset!(app, "view.wgsl");
    app.add_plugins(MaterialPlugin::<ViewMaterial>::default());
}

/// Where vertices lie, in the picture and in the pass before it that finds what is nearest.
const VERTEX_SHADER: &str = "embedded://resecta/view/vertex.wgsl";

/// Half the widest field of view of any telescope, degrees. The mask hides what lies outside of the actual one; this only
/// saves the work of lighting it.
const WIDEST_FIELD_DEG: f32 = 42.0;

/// A surface under the lamp beside the lens.
#[derive(Asset, TypePath, AsBindGroup, Debug, Clone, PartialEq, Default)]
#[bind_group_data(PipelineKey)]
pub struct ViewMaterial {
    /// How it looks.
    #[uniform(0)]
    pub look: Look,
    /// Where landmarks are that the shader draws on tissue and walls.
    #[uniform(1)]
    pub anatomy: Anatomy,
    /// What it lets show through.
    pub cover: Cover,
    /// By how many per cent of its distance something may lie before it and is still covered by it; perspective views alone.
    pub nearer_percent: u32,
}

/// What a [`ViewMaterial`] lets show through, by the alpha of colour and vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Cover {
    /// Nothing.
    #[default]
    Opaque,
    /// What lies behind it; what lies before it hides it.
    Among,
    /// Everything: it lies over all at any depth.
    Over,
}

/// How a [`ViewMaterial`] looks.
#[derive(ShaderType, Debug, Clone, PartialEq)]
pub struct Look {
    /// Colour, linear; multiplies the vertex colour where the mesh has one.
    pub colour: LinearRgba,
    /// Colour of a gland's section where nothing else tells one.
    pub beyond: LinearRgba,
    /// A point of the sagittal plane (mm, world) that cuts the object open towards the viewer, and 1; all 0 for none.
    pub section: Vec4,
    /// Strength of highlights, 0 to 1.
    pub gloss: f32,
    /// Exponent of highlights: the higher, the smaller and wetter.
    pub sharpness: f32,
    /// Depth of the surface's fine relief, 0 for smooth.
    pub relief: f32,
    /// Share of the colour that shines by itself, 0 to 1 and above.
    pub glow: f32,
    /// Distance at which the lamp's light has fallen to a quarter, mm; 0 for light that does not fall off.
    pub reach_mm: f32,
    /// Brightness of the light.
    pub brightness: f32,
    /// Cosine of half the lens's field of view: what lies outside is black. -1 for a view that is not round.
    pub field_cos: f32,
    /// What it is, a [`Surface`].
    pub surface: u32,
    /// Light that clouded water takes on the way from the surface to the lens, for each mm; 0 in clear water.
    pub extinction: f32,
    /// Share of the lens that blood covers, 0 to 1.
    pub covered: f32,
}

/// What a [`ViewMaterial`] covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Surface {
    /// Gland: seen from behind it is the section's colour, or a fold.
    Tissue = 0,
    /// The section itself: evenly lit, with the grain of tissue.
    Section = 1,
    /// Anything else.
    Solid = 2,
    /// Its colour alone, not lit.
    Flat = 3,
    /// Mucosa that is not part of the gland: urethra and bladder.
    Wall = 4,
    /// Soft discs of blood in the water, lit from all sides; texture coordinates from -1 to 1.
    Cloud = 5,
}

/// Where a case's landmarks are at rest, mm, and 1; all 0 for one that it does not have.
#[derive(ShaderType, Debug, Clone, PartialEq)]
pub struct Anatomy {
    /// x and y of the gland's middle line, and the heights below and above which its surface is that of its ends, where
    /// urethra and bladder go on.
    pub middle: Vec4,
    /// The verumontanum, on the floor of the lumen.
    pub verumontanum: Vec4,
    /// The bladder neck.
    pub neck: Vec4,
    /// The external sphincter.
    pub sphincter: Vec4,
    /// The bladder's centre, and its radius.
    pub bladder: Vec4,
    /// The ureters' mouths, where they open through the bladder's wall.
    pub orifices: [Vec4; 2],
}

impl Default for Anatomy {
    /// None.
    fn default() -> Self {
        Self {
            middle: Vec4::new(0.0, 0.0, f32::MIN, f32::MAX),
            verumontanum: Vec4::ZERO,
            neck: Vec4::ZERO,
            sphincter: Vec4::ZERO,
            bladder: Vec4::ZERO,
            orifices: [Vec4::ZERO; 2],
        }
    }
}

/// Thickness of what is drawn as an end of the gland, mm.
const END_MM: f64 = 0.3;

impl Anatomy {
    /// Of a case.
    pub fn of_case(case: &Case) -> Self {
        let marks = &case.landmarks;
        let point = |place: Option<DVec3>| place.map_or(Vec4::ZERO, |place| place.as_vec3().extend(1.0));
        let middle = case.slices.first().zip(case.slices.last()).map(|(first, last)| {
            let capsule = &case.slices[case.slices.len() / 2].capsule;
            let middle = capsule.iter().sum::<DVec2>() / capsule.len().max(1) as f64;
            let [low, high] = [first.z + END_MM, last.z - END_MM];
            DVec4::new(middle.x, middle.y, low, high).as_vec4()
        });
        let bladder = BladderShape::of_case(case);
        Self {
            middle: middle.unwrap_or(Self::default().middle),
            verumontanum: point(marks.verumontanum),
            neck: point(marks.bladder_neck),
            sphincter: point(marks.external_sphincter),
            bladder: bladder.map_or(Vec4::ZERO, |shape| {
                shape.centre.as_vec3().extend(shape.radius_mm as f32)
            }),
            orifices: [Landmark::LeftOrifice, Landmark::RightOrifice].map(|orifice| point(orifice.place(case))),
        }
    }
}

impl Default for Look {
    /// Smooth, dull, white, lit by a light that does not fall off.
    fn default() -> Self {
        Look {
            colour: LinearRgba::WHITE,
            beyond: LinearRgba::WHITE,
            section: Vec4::ZERO,
            gloss: 0.0,
            sharpness: 20.0,
            relief: 0.0,
            glow: 0.0,
            reach_mm: 0.0,
            brightness: 1.0,
            field_cos: -1.0,
            surface: Surface::Solid as u32,
            extinction: 0.0,
            covered: 0.0,
        }
    }
}

impl Look {
    /// Under the endoscope's lamp, seen through its lens.
    pub fn under_lamp(self) -> Self {
        Look {
            reach_mm: 10.0,
            brightness: 2.1,
            field_cos: WIDEST_FIELD_DEG.to_radians().cos(),
            ..self
        }
    }
}

impl From<Look> for ViewMaterial {
    fn from(look: Look) -> Self {
        ViewMaterial { look, ..default() }
    }
}

/// What of a material decides the pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PipelineKey {
    cover: Cover,
    nearer_percent: u32,
}

impl From<&ViewMaterial> for PipelineKey {
    fn from(material: &ViewMaterial) -> Self {
        PipelineKey {
            cover: material.cover,
            nearer_percent: material.nearer_percent,
        }
    }
}

impl Material for ViewMaterial {
    fn vertex_shader() -> ShaderRef {
        VERTEX_SHADER.into()
    }

    fn fragment_shader() -> ShaderRef {
        "embedded://resecta/view/view.wgsl".into()
    }

    fn prepass_vertex_shader() -> ShaderRef {
        VERTEX_SHADER.into()
    }

    fn alpha_mode(&self) -> AlphaMode {
        match self.cover {
            Cover::Opaque => AlphaMode::Opaque,
            Cover::Among | Cover::Over => AlphaMode::Blend,
        }
    }

    fn enable_shadows() -> bool {
        false
    }

    fn specialize(
        _pipeline: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _layout: &MeshVertexBufferLayoutRef,
        key: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        // Sections show the inside of closed surfaces.
        descriptor.primitive.cull_mode = None;
        let key = key.bind_group_data;
        let nearer = ShaderDefVal::UInt("NEARER_PERCENT".into(), key.nearer_percent);
        descriptor.vertex.shader_defs.push(nearer);
        if let Some(depth) = &mut descriptor.depth_stencil
            && key.cover == Cover::Over
        {
            depth.depth_compare = Some(CompareFunction::Always);
        }
        Ok(())
    }
}
