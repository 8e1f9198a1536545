//! The motion of a tissue in the memory of the graphics processor, and what is recorded for a stretch of its substeps.
//!
//! A stretch is one submission: what was before is copied aside, then follows a dispatch a substep, each reading the places
//! that the one before wrote, and one that ends the stretch. It answers with eight bytes: the square that the stability
//! bound follows from, and whether velocities are sound. So the bound of the tissue as it lies is checked as often as
//! without a graphics processor, at the cost of one substep in 128 and of one wait; a bound for any shape, which would need
//! no check, would ask for 1.4 to 1.7 times as many substeps.

use glam::{DVec3, Vec3};
use resecta_solver::{Machine, Measured, NodeKick, Stretch, Tissue};
use wgpu::BufferUsages as Usage;

use crate::GpuError;
use crate::device::{Gpu, check_limit};
use crate::layout::{SLICE, Slices};

/// Bytes of a node's place, and of its velocity and what rounding took from the place.
const PLACE: u64 = 16;
const MOTION: u64 = 24;
/// Bytes of the answer to a stretch.
const ANSWER: u64 = 8;

/// The motion of a tissue on the graphics processor.
#[derive(Debug)]
pub(crate) struct Motion {
    gpu: Gpu,
    nodes: u32,
    buffers: Buffers,
    groups: Groups,
    /// Which of the two places holds the present ones.
    present: usize,
    /// Which one did before the last stretch.
    present_before: usize,
    /// What the kicks there were made for.
    kicks_made_for: Option<(f64, u64)>,
    /// Whether the loads there are those of now and stay so.
    loads_stand: bool,
}

#[derive(Debug)]
struct Buffers {
    stretch: wgpu::Buffer,
    rests: wgpu::Buffer,
    motion: wgpu::Buffer,
    loads: wgpu::Buffer,
    found: wgpu::Buffer,
    places: [wgpu::Buffer; 2],
    /// Over half a substep and over a whole one.
    kicks: [wgpu::Buffer; 2],
    /// What was before the stretch.
    places_before: wgpu::Buffer,
    motion_before: wgpu::Buffer,
    answer: wgpu::Buffer,
}

#[derive(Debug)]
struct Groups {
    tissue: wgpu::BindGroup,
    /// From the first places to the second, and back.
    places: [wgpu::BindGroup; 2],
    kicks: [wgpu::BindGroup; 2],
}

/// Where the nodes are and how fast, as they come back.
pub(crate) struct State {
    pub positions: Vec<DVec3>,
    pub velocities: Vec<Vec3>,
}

/// Checks that a tissue of so many nodes and slots does not exceed what an adapter allows, by names and numbers.
fn check_size(nodes: u64, slots: u64, limits: &wgpu::Limits) -> Result<(), GpuError> {
    check_limit(
        "max_compute_workgroups_per_dimension",
        nodes.div_ceil(SLICE as u64),
        limits.max_compute_workgroups_per_dimension.into(),
    )?;
    // The largest: places and motion, and the springs.
    let largest = (MOTION * nodes).max(8 * SLICE as u64 * slots);
    check_limit(
        "max_storage_buffer_binding_size",
        largest,
        limits.max_storage_buffer_binding_size,
    )?;
    check_limit("max_buffer_size", largest, limits.max_buffer_size)
}

impl Motion {
    /// Copies a tissue there.
    pub fn new(gpu: &Gpu, tissue: &Tissue) -> Result<Motion, GpuError> {
        gpu.check()?;
        let nodes = tissue.node_count() as u64;
        let slices = Slices::of(tissue).ok_or(GpuError::Limit {
            limit: "slots for springs",
            needed: u64::from(u32::MAX) + 1,
            allowed: u32::MAX.into(),
        })?;
        check_size(
            nodes,
            slices.starts.last().copied().unwrap_or(0).into(),
            &gpu.device.limits(),
        )?;
        let buffer = |label, size: u64, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                // None may be empty, and copies go by four bytes.
                size: size.max(16),
                usage,
                mapped_at_creation: false,
            })
        };
        let constant = |label, bytes: &[u8]| {
            let constant = buffer(label, bytes.len() as u64, Usage::STORAGE | Usage::COPY_DST);
            gpu.queue.write_buffer(&constant, 0, bytes);
            constant
        };
        let starts = constant("starts of slices", bytemuck::cast_slice(&slices.starts));
        let neighbours = constant("neighbours", bytemuck::cast_slice(&slices.neighbours));
        let springs = constant("springs", bytemuck::cast_slice(&slices.springs));
        let moving = Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC;
        let aside = Usage::COPY_DST | Usage::COPY_SRC;
        let buffers = Buffers {
            stretch: buffer("stretch", 32, Usage::UNIFORM | Usage::COPY_DST),
            rests: buffer("rests", 16 * nodes, Usage::STORAGE | Usage::COPY_DST),
            motion: buffer("motion", MOTION * nodes, moving),
            loads: buffer("loads", 24 * nodes, Usage::STORAGE | Usage::COPY_DST),
            found: buffer("found", ANSWER, moving),
            places: ["places", "places after"].map(|label| buffer(label, PLACE * nodes, moving)),
            kicks: ["half kicks", "kicks"].map(|label| buffer(label, 8 * nodes, Usage::STORAGE | Usage::COPY_DST)),
            places_before: buffer("places before", PLACE * nodes, aside),
            motion_before: buffer("motion before", MOTION * nodes, aside),
            answer: buffer("answer", ANSWER, Usage::COPY_DST | Usage::MAP_READ),
        };
        let group = |number: usize, bound: &[&wgpu::Buffer]| {
            let entries = (0..).zip(bound.iter()).map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            });
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &gpu.program.groups[number],
                entries: &entries.collect::<Vec<_>>(),
            })
        };
        let Buffers {
            stretch,
            rests,
            motion,
            loads,
            found,
            ..
        } = &buffers;
        let [one, other] = &buffers.places;
        let groups = Groups {
            tissue: group(
                0,
                &[stretch, &starts, &neighbours, &springs, rests, motion, loads, found],
            ),
            places: [group(1, &[one, other]), group(1, &[other, one])],
            kicks: buffers.kicks.each_ref().map(|kicks| group(2, &[kicks])),
        };
        let mut motion = Motion {
            gpu: gpu.clone(),
            nodes: nodes as u32,
            buffers,
            groups,
            present: 0,
            present_before: 0,
            kicks_made_for: None,
            loads_stand: false,
        };
        motion.take_over(tissue)?;
        Ok(motion)
    }

    /// Where the nodes are now.
    pub fn state(&self) -> Result<State, GpuError> {
        self.read(&self.buffers.places[self.present], &self.buffers.motion)
    }

    fn read(&self, places: &wgpu::Buffer, motion: &wgpu::Buffer) -> Result<State, GpuError> {
        let fetch = |from: &wgpu::Buffer| -> Result<Vec<f32>, GpuError> {
            let to = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("read back"),
                size: from.size(),
                usage: Usage::COPY_DST | Usage::MAP_READ,
                mapped_at_creation: false,
            });
            let mut encoder = self.encoder();
            encoder.copy_buffer_to_buffer(from, 0, &to, 0, from.size());
            self.gpu.queue.submit([encoder.finish()]);
            Ok(bytemuck::pod_collect_to_vec(&self.gpu.read(&to)?))
        };
        let (places, motion) = (fetch(places)?, fetch(motion)?);
        let n = self.nodes as usize;
        let of = |node: usize, first: usize| Vec3::from_array([0, 1, 2].map(|axis| motion[(first + axis) * n + node]));
        let (places, _) = places.as_chunks::<4>();
        let position = |(node, place): (usize, &[f32; 4])| {
            let [x, y, z, _] = place.map(f64::from);
            DVec3::new(x, y, z) - of(node, 3).as_dvec3()
        };
        Ok(State {
            positions: places[..n].iter().enumerate().map(position).collect(),
            velocities: (0..n).map(|node| of(node, 0)).collect(),
        })
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        let descriptor = wgpu::CommandEncoderDescriptor { label: Some("stretch") };
        self.gpu.device.create_command_encoder(&descriptor)
    }

    fn write(&self, buffer: &wgpu::Buffer, numbers: &[impl bytemuck::NoUninit]) {
        self.gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(numbers));
    }

    fn write_kicks(&mut self, stretch: &Stretch) {
        if self.kicks_made_for == Some(stretch.kicks_made_for()) {
            return;
        }
        self.kicks_made_for = Some(stretch.kicks_made_for());
        let list = |kick: &dyn Fn(u32) -> NodeKick| -> Vec<[f32; 2]> {
            let kicks = (0..self.nodes).map(kick);
            kicks.map(|kick| [kick.decay, kick.push]).collect()
        };
        self.write(&self.buffers.kicks[0], &list(&|node| stretch.half_kick(node)));
        self.write(&self.buffers.kicks[1], &list(&|node| stretch.whole_kick(node)));
    }

    /// Tells whether loads rise during the stretch.
    fn write_loads(&mut self, stretch: &Stretch) -> bool {
        let is_rising = stretch.load_gains().next().is_some();
        if is_rising || !self.loads_stand {
            let n = self.nodes as usize;
            let mut loads = vec![0.0f32; 6 * n];
            let mut set = |node: u32, first: usize, value: Vec3| {
                for (axis, value) in value.to_array().into_iter().enumerate() {
                    loads[(first + axis) * n + node as usize] = value;
                }
            };
            (0..self.nodes).for_each(|node| set(node, 0, stretch.load(node)));
            stretch.load_gains().for_each(|(node, gain)| set(node, 3, gain));
            self.write(&self.buffers.loads, &loads);
        }
        self.loads_stand = !is_rising;
        is_rising
    }
}

impl Machine for Motion {
    type Error = GpuError;

    fn make(&mut self, stretch: &Stretch) -> Result<Measured, GpuError> {
        self.gpu.check()?;
        self.write_kicks(stretch);
        let is_rising = self.write_loads(stretch);
        let substep_s = (stretch.substep_s() as f32).to_bits();
        let fastest = stretch.fastest_mm_per_s().to_bits();
        // In the order of the shader's; the fifth is the 0 that it must not know.
        let numbers = [self.nodes, substep_s, fastest, u32::from(is_rising), 0, 0, 0, 0];
        self.write(&self.buffers.stretch, &numbers);

        let (buffers, groups, program) = (&self.buffers, &self.groups, &self.gpu.program);
        self.present_before = self.present;
        let mut encoder = self.encoder();
        let mut copy =
            |from: &wgpu::Buffer, to: &wgpu::Buffer| encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
        copy(&buffers.places[self.present], &buffers.places_before);
        copy(&buffers.motion, &buffers.motion_before);
        encoder.clear_buffer(&buffers.found, 0, None);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        let workgroups = self.nodes.div_ceil(SLICE as u32);
        pass.set_bind_group(0, &groups.tissue, &[]);
        pass.set_pipeline(&program.substep);
        for substep in 0..stretch.substeps() {
            if substep < 2 {
                pass.set_bind_group(2, &groups.kicks[substep as usize], &[]);
            }
            pass.set_bind_group(1, &groups.places[self.present], &[]);
            pass.dispatch_workgroups(workgroups, 1, 1);
            self.present = 1 - self.present;
        }
        pass.set_pipeline(&program.finish);
        pass.set_bind_group(1, &groups.places[self.present], &[]);
        pass.set_bind_group(2, &groups.kicks[0], &[]);
        pass.dispatch_workgroups(workgroups, 1, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&buffers.found, 0, &buffers.answer, 0, ANSWER);
        self.gpu.queue.submit([encoder.finish()]);

        let answer: Vec<u32> = bytemuck::pod_collect_to_vec(&self.gpu.read(&buffers.answer)?);
        Ok(Measured {
            largest_square: f32::from_bits(answer[0]),
            is_sound: answer[1] == 0,
        })
    }

    fn take_back(&mut self, tissue: &mut Tissue) -> Result<(), GpuError> {
        let state = self.read(&self.buffers.places_before, &self.buffers.motion_before)?;
        state.write_to(tissue)
    }

    fn take_over(&mut self, tissue: &Tissue) -> Result<(), GpuError> {
        let n = self.nodes as usize;
        let (mut places, mut rests) = (Vec::with_capacity(n), Vec::with_capacity(n));
        let mut motion = vec![0.0f32; 6 * n];
        for node in 0..self.nodes {
            let place = tissue.position(node);
            let lost = (place.as_dvec3() - tissue.precise_position(node)).as_vec3();
            let inertia = tissue.inertia_g(node);
            let inverse = if inertia > 0.0 { 1.0 / inertia } else { 0.0 };
            places.push(place.extend(tissue.support(node)).to_array());
            rests.push(tissue.rest_position(node).extend(inverse).to_array());
            let numbers = tissue.velocity(node).to_array().into_iter().chain(lost.to_array());
            for (component, number) in numbers.enumerate() {
                motion[component * n + node as usize] = number;
            }
        }
        self.present = 0;
        self.write(&self.buffers.places[0], &places);
        self.write(&self.buffers.rests, &rests);
        self.write(&self.buffers.motion, &motion);
        (self.kicks_made_for, self.loads_stand) = (None, false);
        self.gpu.check()
    }
}

impl State {
    /// Gives its motion to a tissue.
    pub fn write_to(&self, tissue: &mut Tissue) -> Result<(), GpuError> {
        for (node, (position, velocity)) in (0u32..).zip(self.positions.iter().zip(&self.velocities)) {
            // What has been removed does not move.
            if tissue.is_node_alive(node) {
                tissue.set_motion(node, *position, *velocity)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_large_is_refused_by_name_and_number() {
        let limits = wgpu::Limits {
            max_compute_workgroups_per_dimension: 100,
            max_storage_buffer_binding_size: 200_000,
            max_buffer_size: 150_000,
            ..wgpu::Limits::default()
        };
        assert_eq!(check_size(6_000, 100, &limits), Ok(()));
        let refused = |nodes, slots| match check_size(nodes, slots, &limits) {
            Err(GpuError::Limit { limit, needed, allowed }) => (limit, needed, allowed),
            other => panic!("{other:?}"),
        };
        assert_eq!(refused(6_401, 0), ("max_compute_workgroups_per_dimension", 101, 100));
        assert_eq!(refused(64, 400), ("max_storage_buffer_binding_size", 204_800, 200_000));
        assert_eq!(refused(64, 300), ("max_buffer_size", 153_600, 150_000));
        let message = check_size(6_401, 0, &limits).unwrap_err().to_string();
        assert!(message.contains("workgroups") && message.contains("101"), "{message}");
    }
}
