//! DICOM ultrasound, in files that these tests write.

use std::fs;
use std::path::PathBuf;

use dicom_core::value::{DataSetSequence, PixelFragmentSequence};
use dicom_core::{DataElement, PrimitiveValue, Tag, VR};
use dicom_object::{FileMetaTableBuilder, InMemDicomObject};
use dicom_pixeldata::Transcode;
use dicom_transfer_syntax_registry::entries;
use glam::DVec2;
use proptest::prelude::*;
use resecta_annotate::{Geometry, Heights, ImageError, Stack, StackError, Window, read_stack};
use tempfile::TempDir;

const EXPLICIT: &str = "1.2.840.10008.1.2.1";
const IMPLICIT: &str = "1.2.840.10008.1.2";
const BIG_ENDIAN: &str = "1.2.840.10008.1.2.2";
/// Size of the screens that are written, and of the region of tissue on them.
const SIZE: [usize; 2] = [20, 16];
const REGION: Window = Window {
    left: 4,
    top: 2,
    width: 12,
    height: 10,
};

/// What is written into a file.
#[derive(Clone)]
struct Scan {
    frames: usize,
    photometric: &'static str,
    bits: u16,
    is_planar: bool,
    regions: Vec<[f64; 2]>,
    more: Vec<(Tag, VR, PrimitiveValue)>,
}

impl Default for Scan {
    fn default() -> Self {
        Scan {
            frames: 3,
            photometric: "MONOCHROME2",
            bits: 8,
            is_planar: false,
            regions: vec![[0.03, 0.025]],
            more: vec![(Tag(0x0018, 0x0088), VR::DS, PrimitiveValue::from("5"))],
        }
    }
}

/// Grey level of a pixel, 0 to 255: black outside the region.
fn level(x: usize, y: usize, frame: usize) -> u8 {
    let inside =
        (REGION.left..REGION.left + REGION.width).contains(&x) && (REGION.top..REGION.top + REGION.height).contains(&y);
    if inside {
        (30 * frame + 5 * x + 3 * y + 1) as u8
    } else {
        0
    }
}

impl Scan {
    fn object(&self) -> InMemDicomObject {
        let mut object = InMemDicomObject::new_empty();
        let short = |tag, value: u16| DataElement::new(tag, VR::US, PrimitiveValue::from(value));
        let samples = if self.photometric.starts_with("MONO") { 1 } else { 3 };
        object.put(DataElement::new(
            Tag(0x0008, 0x0016),
            VR::UI,
            PrimitiveValue::from("1.2.840.10008.5.1.4.1.1.3.1"),
        ));
        object.put(DataElement::new(
            Tag(0x0008, 0x0018),
            VR::UI,
            PrimitiveValue::from("1.2.3.4"),
        ));
        object.put(short(Tag(0x0028, 0x0002), samples));
        object.put(DataElement::new(
            Tag(0x0028, 0x0004),
            VR::CS,
            PrimitiveValue::from(self.photometric),
        ));
        object.put(short(Tag(0x0028, 0x0006), u16::from(self.is_planar)));
        object.put(DataElement::new(
            Tag(0x0028, 0x0008),
            VR::IS,
            PrimitiveValue::from(self.frames.to_string()),
        ));
        object.put(short(Tag(0x0028, 0x0010), SIZE[1] as u16));
        object.put(short(Tag(0x0028, 0x0011), SIZE[0] as u16));
        object.put(short(Tag(0x0028, 0x0100), if self.bits > 8 { 16 } else { 8 }));
        object.put(short(Tag(0x0028, 0x0101), self.bits));
        object.put(short(Tag(0x0028, 0x0102), self.bits - 1));
        object.put(short(Tag(0x0028, 0x0103), 0));
        if !self.regions.is_empty() {
            let items: Vec<InMemDicomObject> = self.regions.iter().map(|&delta| region(delta)).collect();
            object.put(DataElement::new(
                Tag(0x0018, 0x6011),
                VR::SQ,
                DataSetSequence::from(items),
            ));
        }
        let bytes = self.pixels();
        let value = if self.bits > 8 {
            let words: Vec<u16> = bytes
                .chunks_exact(2)
                .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
                .collect();
            DataElement::new(Tag(0x7fe0, 0x0010), VR::OW, PrimitiveValue::U16(words.into()))
        } else {
            DataElement::new(Tag(0x7fe0, 0x0010), VR::OB, PrimitiveValue::U8(bytes.into()))
        };
        object.put(value);
        for (tag, vr, value) in &self.more {
            object.put(DataElement::new(*tag, *vr, value.clone()));
        }
        object
    }

    fn pixels(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let count = SIZE[0] * SIZE[1];
        for frame in 0..self.frames {
            let grey = |pixel: usize| level(pixel % SIZE[0], pixel / SIZE[0], frame);
            match self.photometric {
                "MONOCHROME1" => bytes.extend((0..count).map(|pixel| 255 - grey(pixel))),
                "YBR_FULL" => bytes.extend((0..count).flat_map(|pixel| [grey(pixel), 128, 128])),
                "RGB" if self.is_planar => bytes.extend((0..3 * count).map(|sample| grey(sample % count))),
                "RGB" => bytes.extend((0..count).flat_map(|pixel| [grey(pixel); 3])),
                _ if self.bits > 8 => {
                    let white = (1_u32 << self.bits) - 1;
                    let wide = |pixel| (u32::from(grey(pixel)) * white / 255) as u16;
                    bytes.extend((0..count).flat_map(|pixel| wide(pixel).to_le_bytes()));
                }
                _ => bytes.extend((0..count).map(grey)),
            }
        }
        bytes
    }

    fn bytes(&self, syntax: &str) -> Vec<u8> {
        let meta = FileMetaTableBuilder::new().transfer_syntax(syntax);
        let mut bytes = Vec::new();
        self.object().with_meta(meta).unwrap().write_all(&mut bytes).unwrap();
        bytes
    }
}

fn region([x, y]: [f64; 2]) -> InMemDicomObject {
    let mut item = InMemDicomObject::new_empty();
    for (element, value) in [(0x6012, 1_u16), (0x6014, 1), (0x6024, 3), (0x6026, 3)] {
        item.put(DataElement::new(
            Tag(0x0018, element),
            VR::US,
            PrimitiveValue::from(value),
        ));
    }
    let last = [REGION.left + REGION.width - 1, REGION.top + REGION.height - 1];
    for (element, value) in [
        (0x6018, REGION.left),
        (0x601a, REGION.top),
        (0x601c, last[0]),
        (0x601e, last[1]),
    ] {
        item.put(DataElement::new(
            Tag(0x0018, element),
            VR::UL,
            PrimitiveValue::from(value as u32),
        ));
    }
    for (element, value) in [(0x602c, x), (0x602e, y)] {
        item.put(DataElement::new(
            Tag(0x0018, element),
            VR::FD,
            PrimitiveValue::from(value),
        ));
    }
    item
}

fn read_bytes(bytes: &[u8], geometry: &Geometry) -> Result<Stack, StackError> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("sweep.dcm");
    fs::write(&path, bytes).unwrap();
    read_stack(&path, geometry)
}

fn read(scan: &Scan) -> Result<Stack, StackError> {
    read_bytes(&scan.bytes(EXPLICIT), &Geometry::default())
}

/// Every pixel of the region stands where the region's spacing puts it, with the level that was written.
fn assert_written(stack: &Stack, tolerance: f32) {
    for (frame, slice) in stack.slices().iter().enumerate() {
        assert_eq!(slice.z_mm, 5.0 * frame as f64);
        assert_eq!(
            [slice.image.width(), slice.image.height()],
            [REGION.width, REGION.height]
        );
        for (x, y) in [(4, 2), (9, 7), (15, 11)] {
            let grey = slice
                .image
                .grey_at(DVec2::new(0.3 * x as f64, 0.25 * y as f64))
                .unwrap();
            let expected = f32::from(level(x, y, frame)) / 255.0;
            assert!(
                (grey - expected).abs() <= tolerance,
                "({x}, {y}): {grey}, expected {expected}"
            );
        }
    }
}

#[test]
fn frames_lie_where_the_calibrated_region_puts_them() {
    let stack = read(&Scan::default()).unwrap();
    assert_eq!(stack.slices().len(), 3);
    let spacing = stack.slices()[0].image.spacing_mm();
    assert!((spacing[0] - 0.3).abs() < 1e-12 && (spacing[1] - 0.25).abs() < 1e-12);
    assert_written(&stack, 1e-6);
}

#[test]
fn all_ways_of_writing_pixels_give_the_same_picture() {
    for (photometric, bits, is_planar) in [
        ("MONOCHROME1", 8, false),
        ("MONOCHROME2", 12, false),
        ("MONOCHROME2", 16, false),
        ("RGB", 8, false),
        ("RGB", 8, true),
        ("YBR_FULL", 8, false),
    ] {
        let scan = Scan {
            photometric,
            bits,
            is_planar,
            ..Scan::default()
        };
        assert_written(&read(&scan).unwrap(), 0.003);
    }
    assert_written(
        &read_bytes(&Scan::default().bytes(IMPLICIT), &Geometry::default()).unwrap(),
        1e-6,
    );
}

#[test]
fn compressed_frames_are_decoded() {
    let scan = Scan::default();
    let mut object = scan
        .object()
        .with_meta(FileMetaTableBuilder::new().transfer_syntax(EXPLICIT))
        .unwrap();
    object.transcode(&entries::JPEG_BASELINE.erased()).unwrap();
    let mut bytes = Vec::new();
    object.write_all(&mut bytes).unwrap();
    // Lossy, and these pictures have edges.
    assert_written(&read_bytes(&bytes, &Geometry::default()).unwrap(), 0.08);
}

/// A frame compressed by runs, of which there are none: each segment one channel, in stretches of at most 128 bytes.
fn run_lengths(frame: &[u8]) -> Vec<u8> {
    let channels = frame.len() / (SIZE[0] * SIZE[1]);
    let mut header = vec![channels as u32];
    let mut segments = Vec::new();
    for channel in 0..channels {
        header.push(64 + segments.len() as u32);
        let samples: Vec<u8> = frame.iter().skip(channel).step_by(channels).copied().collect();
        for stretch in samples.chunks(128) {
            segments.push(stretch.len() as u8 - 1);
            segments.extend(stretch);
        }
        segments.resize(segments.len().next_multiple_of(2), 128);
    }
    header.resize(16, 0);
    header.into_iter().flat_map(u32::to_le_bytes).chain(segments).collect()
}

#[test]
fn frames_of_run_lengths_are_decoded_in_grey_and_in_colours() {
    for photometric in ["MONOCHROME2", "RGB", "YBR_FULL"] {
        let scan = Scan {
            photometric,
            ..Scan::default()
        };
        let pixels = scan.pixels();
        let fragments: Vec<Vec<u8>> = pixels
            .chunks_exact(pixels.len() / scan.frames)
            .map(run_lengths)
            .collect();
        let mut object = scan.object();
        object.put(DataElement::new(
            Tag(0x7fe0, 0x0010),
            VR::OB,
            PixelFragmentSequence::new_fragments(fragments),
        ));
        let mut bytes = Vec::new();
        let meta = FileMetaTableBuilder::new().transfer_syntax("1.2.840.10008.1.2.5");
        object.with_meta(meta).unwrap().write_all(&mut bytes).unwrap();
        assert_written(&read_bytes(&bytes, &Geometry::default()).unwrap(), 0.003);
    }
}

#[test]
fn without_a_region_or_a_distance_the_caller_must_tell() {
    let no_region = Scan {
        regions: Vec::new(),
        ..Scan::default()
    };
    let error = read(&no_region).unwrap_err();
    assert!(matches!(error, StackError::Missing { field: "spacing", .. }), "{error}");
    let no_distance = Scan {
        more: Vec::new(),
        ..Scan::default()
    };
    let error = read(&no_distance).unwrap_err();
    assert!(matches!(error, StackError::Missing { field: "z", .. }), "{error}");

    let given = Geometry {
        spacing: Some([0.3, 0.25]),
        z: Some(Heights::Even {
            first: 0.0,
            distance: 5.0,
        }),
        window: Some(REGION),
        ..Geometry::default()
    };
    assert_written(&read_bytes(&no_region.bytes(EXPLICIT), &given).unwrap(), 1e-6);
    // What stands in for the file's geometry is told.
    let stack = read_bytes(&Scan::default().bytes(EXPLICIT), &given).unwrap();
    for what in ["spacing", "z"] {
        assert!(stack.notes.iter().any(|note| note.what == what), "{:?}", stack.notes);
    }
}

#[test]
fn geometry_that_contradicts_itself_is_an_error_by_name() {
    let spacing = |value: &str| (Tag(0x0028, 0x0030), VR::DS, PrimitiveValue::from(value));
    let with = |value| Scan {
        more: [Scan::default().more, vec![spacing(value)]].concat(),
        ..Scan::default()
    };
    // Row distance comes first.
    assert!(read(&with("0.25\\0.3")).is_ok());
    let error = read(&with("0.3\\0.25")).unwrap_err();
    assert!(
        matches!(error, StackError::Contradiction { field: "spacing", .. }),
        "{error}"
    );
    for delta in [0.0, f64::NAN, 9.0] {
        let scan = Scan {
            regions: vec![[0.03, delta]],
            ..Scan::default()
        };
        let error = read(&scan).unwrap_err();
        assert!(
            matches!(
                error,
                StackError::Image {
                    error: ImageError::Spacing {
                        along: "along a column",
                        ..
                    },
                    ..
                }
            ),
            "{error}"
        );
    }
    // A caller who knows better goes before all of that.
    let given = Geometry {
        spacing: Some([0.3, 0.25]),
        ..Geometry::default()
    };
    let broken = Scan {
        regions: vec![[0.0, f64::NAN]],
        ..with("0.3\\0.25")
    };
    assert_written(&read_bytes(&broken.bytes(EXPLICIT), &given).unwrap(), 1e-6);
    let two = Scan {
        regions: vec![[0.03, 0.025]; 2],
        ..Scan::default()
    };
    let error = read(&two).unwrap_err();
    assert!(
        matches!(error, StackError::Contradiction { field: "window", .. }),
        "{error}"
    );
}

#[test]
fn colours_are_refused_and_so_are_kinds_that_are_not_read() {
    let mut photo = Scan {
        photometric: "RGB",
        ..Scan::default()
    }
    .object();
    let bytes: Vec<u8> = (0..3 * 3 * SIZE[0] * SIZE[1])
        .map(|sample| (sample * 41 % 251) as u8)
        .collect();
    photo.put(DataElement::new(
        Tag(0x7fe0, 0x0010),
        VR::OB,
        PrimitiveValue::U8(bytes.into()),
    ));
    let meta = FileMetaTableBuilder::new().transfer_syntax(EXPLICIT);
    let mut bytes = Vec::new();
    photo.with_meta(meta).unwrap().write_all(&mut bytes).unwrap();
    let error = read_bytes(&bytes, &Geometry::default()).unwrap_err();
    assert!(matches!(error, StackError::Coloured { .. }), "{error}");

    let palette = Scan {
        more: vec![(Tag(0x0028, 0x0004), VR::CS, PrimitiveValue::from("PALETTE COLOR"))],
        ..Scan::default()
    };
    let error = read(&palette).unwrap_err();
    assert!(error.to_string().contains("PALETTE COLOR"), "{error}");
    let error = read_bytes(&Scan::default().bytes(BIG_ENDIAN), &Geometry::default()).unwrap_err();
    assert!(error.to_string().contains("big-endian"), "{error}");
    let many = Scan {
        more: vec![(Tag(0x0028, 0x0008), VR::IS, PrimitiveValue::from("100000"))],
        ..Scan::default()
    };
    let error = read(&many).unwrap_err();
    assert!(error.to_string().contains("100000 images"), "{error}");
    let few = Scan {
        more: vec![(Tag(0x0028, 0x0008), VR::IS, PrimitiveValue::from("7"))],
        ..Scan::default()
    };
    let error = read(&few).unwrap_err();
    assert!(matches!(error, StackError::Picture { .. }), "{error}");
}

#[test]
fn a_folder_of_single_frames_is_a_stack_by_their_locations() {
    let folder = TempDir::new().unwrap();
    for (name, location) in [("a.dcm", "10"), ("b.dcm", "0"), ("c.dcm", "5")] {
        let scan = Scan {
            frames: 1,
            more: vec![(Tag(0x0020, 0x1041), VR::DS, PrimitiveValue::from(location))],
            ..Scan::default()
        };
        fs::write(folder.path().join(name), scan.bytes(EXPLICIT)).unwrap();
    }
    let read = || read_stack(folder.path(), &Geometry::default());
    let heights: Vec<f64> = read().unwrap().slices().iter().map(|slice| slice.z_mm).collect();
    assert_eq!(heights, [0.0, 5.0, 10.0]);
    let again: PathBuf = folder.path().join("d.dcm");
    fs::copy(folder.path().join("c.dcm"), &again).unwrap();
    let error = read().unwrap_err();
    assert!(
        matches!(&error, StackError::SameHeight { file, .. } if *file == again),
        "{error}"
    );
}

#[test]
fn lengths_beyond_the_file_and_endless_nesting_are_refused_before_they_are_parsed() {
    let whole = Scan::default().bytes(EXPLICIT);
    for length in (0..whole.len()).step_by(7) {
        assert!(
            read_bytes(&whole[..length], &Geometry::default()).is_err(),
            "cut at {length}"
        );
    }
    for (syntax, header) in [
        (EXPLICIT, &b"\x18\x00\x11\x60SQ\x00\x00\xff\xff\xff\xff"[..]),
        (IMPLICIT, &b"\x18\x00\x11\x60\xff\xff\xff\xff"[..]),
    ] {
        let meta = FileMetaTableBuilder::new()
            .transfer_syntax(syntax)
            .media_storage_sop_class_uid("1.2.3")
            .media_storage_sop_instance_uid("1.2.3.4");
        let mut bytes = Vec::new();
        InMemDicomObject::new_empty()
            .with_meta(meta)
            .unwrap()
            .write_all(&mut bytes)
            .unwrap();
        for _ in 0..100_000 {
            bytes.extend_from_slice(header);
            bytes.extend_from_slice(b"\xfe\xff\x00\xe0\xff\xff\xff\xff");
        }
        let error = read_bytes(&bytes, &Geometry::default()).unwrap_err();
        assert!(error.to_string().contains("nested deeper"), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn a_damaged_file_is_an_error_or_a_stack_and_never_a_panic(
        is_implicit: bool,
        damage in proptest::collection::vec((0_usize..2000, any::<u8>()), 1..6),
    ) {
        let mut bytes = Scan::default().bytes(if is_implicit { IMPLICIT } else { EXPLICIT });
        let count = bytes.len().min(2000);
        for (at, value) in damage {
            bytes[at % count] = value;
        }
        if let Err(error) = read_bytes(&bytes, &Geometry::default()) {
            prop_assert!(error.to_string().contains("sweep.dcm"), "{error}");
        }
    }
}
