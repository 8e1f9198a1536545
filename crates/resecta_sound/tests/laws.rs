//! What must hold of every sound: its tone, its range, its ramps, its silence, and that blocks do not matter.

use std::f64::consts::TAU;

use resecta_sound::{
    CAPSULE_HZ, CLOUDED_HZ, COAGULATION_HZ, CUTTING_HZ, FULL_FLOW_ML_PER_S, INFLOW_HZ, OUTFLOW_HZ, PRESSURE_HZ,
    SoundState, Synth, TOUR, tour, wav,
};

const RATE_HZ: u32 = 48_000;
const SEED: u64 = 7;

const NOTHING: SoundState = SoundState::NOTHING;

const ALL: SoundState = SoundState {
    cut: true,
    coagulate: true,
    contact: 1.0,
    inflow_ml_per_s: FULL_FLOW_ML_PER_S,
    outflow_ml_per_s: FULL_FLOW_ML_PER_S,
    capsule_touched: true,
    pressure_high: true,
    view_clouded: true,
    volume: 1.0,
};

fn samples(seconds: f64, rate_hz: u32) -> usize {
    (seconds * f64::from(rate_hz)) as usize
}

fn play(synth: &mut Synth, heard: &SoundState, seconds: f64) -> Vec<f32> {
    let mut out = vec![f32::NAN; samples(seconds, synth.rate_hz())];
    synth.render(heard, &mut out);
    out
}

/// Some seconds of a sound, without its first 60 ms: the pedal's click and all ramps but the water's are over by then.
fn steady(heard: &SoundState, seconds: f64, rate_hz: u32) -> Vec<f32> {
    let mut synth = Synth::new(rate_hz, SEED).unwrap();
    play(&mut synth, heard, 0.06);
    play(&mut synth, heard, seconds)
}

/// Power at a frequency: a row of the discrete Fourier transform under a window of Hann's, by Goertzel's recurrence.
fn power_at(sound: &[f32], frequency_hz: f64, rate_hz: u32) -> f64 {
    let count = sound.len() as f64;
    // Twice the cosine of a step's angle is all that a recurrence of sines needs.
    let turn = 2.0 * (TAU / count).cos();
    let row = 2.0 * (TAU * frequency_hz / f64::from(rate_hz)).cos();
    let (mut cosine, mut before) = (1.0, turn / 2.0);
    let (mut last, mut second) = (0.0, 0.0);
    for &sample in sound {
        let window = 0.5 - 0.5 * cosine;
        (cosine, before) = (turn * cosine - before, cosine);
        (last, second) = (window * f64::from(sample) + row * last - second, last);
    }
    (last * last + second * second - row * last * second) / (count * count)
}

/// The frequency of the most power, Hz, of those to 3 kHz in steps of 4 Hz.
fn peak_hz(sound: &[f32], rate_hz: u32) -> f64 {
    let rows = (10..750).map(|row| 4.0 * f64::from(row));
    let powers = rows.map(|frequency| (frequency, power_at(sound, frequency, rate_hz)));
    powers.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0
}

fn loudness(sound: &[f32]) -> f64 {
    (sound.iter().map(|&sample| f64::from(sample).powi(2)).sum::<f64>() / sound.len() as f64).sqrt()
}

fn largest_jump(sound: &[f32]) -> f32 {
    sound
        .windows(2)
        .fold(0.0, |most: f32, pair| most.max((pair[1] - pair[0]).abs()))
}

fn with(change: impl FnOnce(&mut SoundState)) -> SoundState {
    let mut heard = NOTHING;
    change(&mut heard);
    heard
}

fn cutting() -> SoundState {
    with(|heard| heard.cut = true)
}

#[test]
fn each_tone_has_its_frequency_at_any_rate_of_samples() {
    // Told apart, the coagulating one lower.
    const { assert!(COAGULATION_HZ < 0.8 * CUTTING_HZ) };
    for rate_hz in [44_100, 48_000, 96_000] {
        for (heard, tone_hz) in [
            (cutting(), CUTTING_HZ),
            (with(|heard| heard.coagulate = true), COAGULATION_HZ),
            (with(|heard| heard.capsule_touched = true), CAPSULE_HZ),
            (with(|heard| heard.pressure_high = true), PRESSURE_HZ),
            (with(|heard| heard.view_clouded = true), CLOUDED_HZ),
        ] {
            let peak = peak_hz(&steady(&heard, 0.25, rate_hz), rate_hz);
            assert!(
                (peak - tone_hz).abs() <= 6.0,
                "{heard:?} at {rate_hz}: {peak} Hz, not {tone_hz}"
            );
        }
    }
}

#[test]
fn of_both_pedals_the_cutting_one_is_heard() {
    let both = with(|heard| (heard.cut, heard.coagulate) = (true, true));
    let sound = steady(&both, 0.5, RATE_HZ);
    assert!((peak_hz(&sound, RATE_HZ) - CUTTING_HZ).abs() <= 6.0);
    assert!(power_at(&sound, COAGULATION_HZ, RATE_HZ) < 1e-3 * power_at(&sound, CUTTING_HZ, RATE_HZ));
}

#[test]
fn water_rushes_about_its_own_frequencies_and_louder_with_the_flow() {
    let streams: [(f64, fn(&mut SoundState, f32)); 2] = [
        (INFLOW_HZ, |heard, flow| heard.inflow_ml_per_s = flow),
        (OUTFLOW_HZ, |heard, flow| heard.outflow_ml_per_s = flow),
    ];
    for (middle_hz, set) in streams {
        let sound = |flow| steady(&with(|heard| set(heard, flow)), 1.0, RATE_HZ);
        let loud = sound(FULL_FLOW_ML_PER_S);
        // Noise: an octave is the mean of its rows.
        let octave = |about_hz: f64| {
            let rows = (-40..=40).map(|row| about_hz * 2f64.powf(f64::from(row) / 80.0));
            rows.map(|frequency| power_at(&loud, frequency, RATE_HZ)).sum::<f64>() / 81.0
        };
        let middle = octave(middle_hz);
        assert!(middle > 4.0 * octave(middle_hz / 8.0), "{middle_hz}: below");
        assert!(middle > 4.0 * octave(middle_hz * 8.0), "{middle_hz}: above");
        let mut last = loudness(&sound(0.0));
        assert_eq!(last, 0.0, "no flow, no sound");
        for share in [0.01, 0.1, 0.3, 1.0] {
            let now = loudness(&sound(share * FULL_FLOW_ML_PER_S));
            assert!(now > 1.3 * last, "{middle_hz}: {now} at {share}, after {last}");
            last = now;
        }
        assert_eq!(sound(1000.0), loud, "no louder than a tap that is wide open");
    }
}

#[test]
fn sparks_crackle_where_a_current_meets_tissue_and_nowhere_else() {
    // Above the tones' overtones.
    let crackle = |heard: SoundState| -> f64 {
        let sound = steady(&heard, 0.5, RATE_HZ);
        let rows = (0..60).map(|row| 3000.0 + 50.0 * f64::from(row));
        rows.map(|frequency| power_at(&sound, frequency, RATE_HZ)).sum()
    };
    let contact = |contact| move |heard: &mut SoundState| heard.contact = contact;
    assert_eq!(loudness(&steady(&with(contact(1.0)), 0.5, RATE_HZ)), 0.0, "no current");
    let in_tissue = crackle(with(|heard| (heard.cut, heard.contact) = (true, 1.0)));
    let less = crackle(with(|heard| (heard.cut, heard.contact) = (true, 0.2)));
    let coagulating = crackle(with(|heard| (heard.coagulate, heard.contact) = (true, 1.0)));
    let in_water = crackle(cutting());
    assert!(
        in_tissue > 2.0 * less && less > 100.0 * in_water,
        "{in_tissue} {less} {in_water}"
    );
    assert!(
        in_tissue > coagulating && coagulating > 100.0 * in_water,
        "{coagulating}"
    );
}

#[test]
fn all_of_it_stays_in_range_whatever_is_asked_for() {
    let odd = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        -1.0,
        0.0,
        1e-40,
        0.5,
        1.0,
        1e30,
        f32::MAX,
    ];
    let mut synth = Synth::new(RATE_HZ, SEED).unwrap();
    let mut loudest: f32 = 0.0;
    for at in 0..400 {
        let pick = |step: usize| odd[(at * step) % odd.len()];
        let bit = |nth: usize| at >> nth & 1 == 1;
        let heard = SoundState {
            cut: bit(0),
            coagulate: bit(1),
            capsule_touched: bit(2),
            pressure_high: bit(3),
            view_clouded: bit(4),
            contact: pick(3),
            inflow_ml_per_s: pick(7),
            outflow_ml_per_s: pick(9),
            volume: pick(1),
        };
        for sample in play(&mut synth, &heard, 0.005) {
            assert!(sample.is_finite() && sample.abs() <= 1.0, "{sample} of {heard:?}");
        }
    }
    for sample in play(&mut synth, &ALL, 2.0) {
        loudest = loudest.max(sample.abs());
    }
    assert!(loudest <= 1.0 && loudest > 0.5, "{loudest}");
    for rate_hz in [8_000, 768_000] {
        let mut synth = Synth::new(rate_hz, SEED).unwrap();
        let sound = play(&mut synth, &ALL, 0.2);
        assert!(sound.iter().all(|sample| sample.is_finite() && sample.abs() <= 1.0));
    }
    for rate_hz in [0, 7_999, 768_001] {
        let error = Synth::new(rate_hz, SEED).expect_err("no rate for these sounds");
        assert!(
            error
                .to_string()
                .starts_with(&format!("rate_hz is {rate_hz}, expected 8,000"))
        );
    }
}

#[test]
fn silence_is_nothing_and_comes_back_after_all_was_heard() {
    let mut synth = Synth::new(RATE_HZ, SEED).unwrap();
    assert!(play(&mut synth, &NOTHING, 0.5).iter().all(|&sample| sample == 0.0));
    assert!(loudness(&play(&mut synth, &ALL, 1.0)) > 0.1);
    // What an alarm has begun it ends.
    play(&mut synth, &NOTHING, 0.6);
    assert!(play(&mut synth, &NOTHING, 1.0).iter().all(|&sample| sample == 0.0));
}

#[test]
fn no_sound_begins_or_ends_with_a_click() {
    for (name, heard) in TOUR {
        let mut synth = Synth::new(RATE_HZ, SEED).unwrap();
        // The pedal clicks on purpose: it has gone down before, unheard.
        let muted = SoundState { volume: 0.0, ..heard };
        let before = play(&mut synth, &muted, 0.3);
        assert_eq!(largest_jump(&before), 0.0, "{name} is muted");
        let on = play(&mut synth, &heard, 5.0);
        let muted_again = play(&mut synth, &muted, 0.1);
        let whole = [&before[..], &on, &muted_again].concat();
        // Where it is on and goes on, it moves as fast as anywhere.
        let steady = largest_jump(&on[samples(0.05, RATE_HZ)..]);
        assert!(steady > 0.0, "{name} is heard");
        assert!(
            largest_jump(&whole) <= steady,
            "{name} jumps by {} after {steady}",
            largest_jump(&whole)
        );
        assert_eq!(loudness(&muted_again[samples(0.05, RATE_HZ)..]), 0.0);
        // The measure sees a click: the same cut off where it is loud.
        let (at, loud) = (on.iter().copied().enumerate()).fold((0, 0.0f32), |most, (at, sample)| {
            if sample.abs() > most.1.abs() {
                (at, sample)
            } else {
                most
            }
        });
        let mut cut_off = on[..=at].to_vec();
        cut_off.push(0.0);
        assert!(loud.abs() > steady && largest_jump(&cut_off) > steady, "{name}");
    }
}

#[test]
fn a_pedal_is_heard_when_it_moves_and_moves_no_faster_than_its_parts() {
    let mut synth = Synth::new(RATE_HZ, SEED).unwrap();
    play(&mut synth, &NOTHING, 0.1);
    let pedal = with(|heard| heard.coagulate = true);
    let [down, held, up] = [(pedal, 0.06), (pedal, 0.3), (NOTHING, 0.06)].map(|(heard, seconds)| {
        let sound = play(&mut synth, &heard, seconds);
        // The click rings at 1,900 Hz, where the tone has no overtone.
        let click = power_at(&sound[..samples(0.03, RATE_HZ)], 1900.0, RATE_HZ);
        (click, f64::from(largest_jump(&sound)))
    });
    // Of the click: parts of 1,900 Hz and 210 Hz, as loud as they would be without dying away.
    let moves = |level: f64, frequency_hz: f64| TAU * frequency_hz / f64::from(RATE_HZ) * level;
    let click = moves(0.20, 1900.0) + moves(0.25, 210.0);
    for (_, jump) in [down, up] {
        assert!(jump <= held.1 + click, "{jump}");
    }
    assert!(down.0 > 2.0 * up.0 && up.0 > 20.0 * held.0, "{down:?} {up:?} {held:?}");
}

#[test]
fn an_alarm_for_a_moment_is_heard_whole_and_once() {
    let mut synth = Synth::new(RATE_HZ, SEED).unwrap();
    let mut sound = play(&mut synth, &with(|heard| heard.capsule_touched = true), 0.02);
    sound.extend(play(&mut synth, &NOTHING, 2.0));
    let pieces: Vec<bool> = (sound.chunks(samples(0.01, RATE_HZ)).map(|piece| loudness(piece) > 0.05)).collect();
    let pulses = pieces.windows(2).filter(|pair| pair[0] && !pair[1]).count();
    assert_eq!(pulses, 3);
    assert!(!pieces[60..].contains(&true));
}

#[test]
fn half_the_volume_is_quieter_and_none_is_silence() {
    let at = |volume| loudness(&steady(&SoundState { volume, ..cutting() }, 0.5, RATE_HZ));
    // Loudness goes with the square, below the limiter's knee.
    assert!((at(0.5) / at(1.0) - 0.25).abs() < 1e-3, "{}", at(0.5) / at(1.0));
    assert_eq!(at(0.0), 0.0);
    assert_eq!(at(f32::NAN), 0.0);
}

#[test]
fn blocks_of_any_length_give_the_same_bits_and_the_seed_gives_the_noise() {
    let changes = [
        (NOTHING, 500),
        (ALL, 9_001),
        (cutting(), 4_800),
        (NOTHING, 2_345),
        (ALL, 12_000),
    ];
    let render = |block: usize, seed: u64| -> Vec<u32> {
        let mut synth = Synth::new(RATE_HZ, seed).unwrap();
        let mut bits = Vec::new();
        for (heard, count) in changes {
            let mut out = vec![0.0; count];
            for piece in out.chunks_mut(block) {
                synth.render(&heard, piece);
            }
            bits.extend(out.iter().map(|sample| sample.to_bits()));
        }
        bits
    };
    let whole = render(usize::MAX, SEED);
    for block in [1, 7, 64, 480, 1024] {
        assert!(render(block, SEED) == whole, "blocks of {block}");
    }
    assert!(render(480, SEED + 1) != whole, "another seed, other sparks");
}

#[test]
fn the_tour_can_be_listened_to_as_a_file() {
    let stops = tour(RATE_HZ, SEED).unwrap();
    for stop in &stops {
        assert!(loudness(&stop.samples) > 0.01, "{} is heard", stop.name);
    }
    let sound: Vec<f32> = stops.into_iter().flat_map(|stop| stop.samples).collect();
    let file = wav(RATE_HZ, &sound);
    let number = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap());
    assert_eq!(
        (&file[..4], &file[8..16], &file[36..40]),
        (&b"RIFF"[..], &b"WAVEfmt "[..], &b"data"[..])
    );
    assert_eq!(number(4) as usize, file.len() - 8);
    assert_eq!(number(40) as usize, 2 * sound.len());
    assert_eq!((number(24), number(28)), (RATE_HZ, 2 * RATE_HZ));
    for (bytes, sample) in file[44..].chunks(2).zip(&sound) {
        let read = f32::from(i16::from_le_bytes([bytes[0], bytes[1]])) / f32::from(i16::MAX);
        assert!((read - sample).abs() <= 0.5 / f32::from(i16::MAX) + 1e-6);
    }
}
