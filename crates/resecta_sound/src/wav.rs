//! Samples as a file: RIFF WAVE, one channel, whole numbers of 16 bits.

/// Length of what stands before the samples, bytes.
const HEADER: usize = 44;

/// A file of these samples (-1 to 1; what is more is cut off), `rate_hz` of them a second.
pub fn wav(rate_hz: u32, samples: &[f32]) -> Vec<u8> {
    let data = u32::try_from(2 * samples.len()).unwrap_or(u32::MAX);
    let mut file = Vec::with_capacity(HEADER + 2 * samples.len());
    file.extend(b"RIFF");
    file.extend(data.saturating_add(HEADER as u32 - 8).to_le_bytes());
    file.extend(b"WAVEfmt ");
    file.extend(16u32.to_le_bytes());
    // PCM, one channel.
    file.extend(1u16.to_le_bytes());
    file.extend(1u16.to_le_bytes());
    file.extend(rate_hz.to_le_bytes());
    file.extend(rate_hz.saturating_mul(2).to_le_bytes());
    // Bytes and bits of a sample.
    file.extend(2u16.to_le_bytes());
    file.extend(16u16.to_le_bytes());
    file.extend(b"data");
    file.extend(data.to_le_bytes());
    for sample in samples {
        file.extend(((sample.clamp(-1.0, 1.0) * f32::from(i16::MAX)).round() as i16).to_le_bytes());
    }
    file
}
