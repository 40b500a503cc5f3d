//! Random damage to bytes, text and JSON, reproducible from a seed.

use serde_json::{Value, json};
use std::{
    collections::BTreeMap,
    sync::mpsc::{RecvTimeoutError, channel},
    time::{Duration, Instant},
};

/// Number of cases of each kind, unless `FOLIAGE_FUZZ_CASES` is set.
const CASES: u64 = 5000;
/// Longest time that one case may take.
const LIMIT: Duration = Duration::from_secs(1);

/// Runs each case with `run`, which returns the name of its outcome. Fails if a case panics or
/// takes longer than [`LIMIT`], or if an outcome in `expected` does not occur in at least [`CASES`]
/// cases.
pub fn survive(kind: &str, expected: &[&str], run: impl Fn(&mut Random) -> &'static str + Send + 'static) {
    let cases = std::env::var("FOLIAGE_FUZZ_CASES").map_or(CASES, |cases| cases.parse().expect("a number of cases"));
    let started = Instant::now();
    let (sender, receiver) = channel();
    let worker = std::thread::spawn(move || {
        for case in 0..cases {
            sender.send(run(&mut Random::new(case))).unwrap();
        }
    });
    let mut outcomes: BTreeMap<&str, u64> = BTreeMap::new();
    let ended = loop {
        match receiver.recv_timeout(LIMIT) {
            Ok(outcome) => *outcomes.entry(outcome).or_default() += 1,
            Err(ended) => break ended,
        }
    };
    let done: u64 = outcomes.values().sum();
    assert_eq!(ended, RecvTimeoutError::Disconnected, "case {done} of {kind} takes more than {LIMIT:?}");
    assert!(worker.join().is_ok(), "case {done} of {kind} panics");
    println!("{kind}: {done} cases in {:.1} s: {outcomes:?}", started.elapsed().as_secs_f64());
    let missing = expected.iter().find(|outcome| !outcomes.contains_key(*outcome));
    assert!(cases < CASES || missing.is_none(), "no case of {kind} ended as {missing:?}: {outcomes:?}");
}

/// Values at which counts, offsets and floats tend to break.
const NOTABLE: [u64; 21] = [
    0,
    1,
    2,
    3,
    0x7F,
    0xFF,
    0xFFFF,
    1 << 20,
    0x0000_0001_0000_0000,
    0x7FFF_FFFF,
    0x8000_0000,
    0xFFFF_FFFF,
    0x3F80_0000, // 1.0
    0xBF80_0000, // -1.0
    0x3F80_0001, // just above 1.0
    0x7F7F_FFFF, // largest finite f32
    0x7F80_0000, // infinity
    0xFFC0_0000, // not a number
    1 << 62,
    u64::MAX - 55,
    u64::MAX,
];
/// Numbers as text, separated by spaces.
const NUMBERS: &str = "0 -0.0 1 -1 2 0.5 1e-45 1e30 -3e38 1e39 1e400 nan -inf 4294967295 9223372036854775807 \
    99999999999999999999";
/// Longest run of bytes that is removed, duplicated or copied.
const LONGEST_RUN: usize = 64;

/// Pseudorandom numbers from a seed: xorshift64* (Vigna, 2016).
pub struct Random(u64);

impl Random {
    /// A different stream for every seed below `u64::MAX`.
    pub fn new(seed: u64) -> Self {
        Self((seed + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15))
    }

    fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// An integer from 0 up to but not including `end`; 0 if `end` is 0.
    pub fn below(&mut self, end: usize) -> usize {
        (self.bits() >> 32) as usize % end.max(1)
    }

    /// One of the words of `text`, which are separated by single spaces.
    fn word<'a>(&mut self, text: &'a str) -> &'a str {
        let words = text.split(' ');
        words.clone().nth(self.below(words.count())).unwrap_or_default()
    }

    /// One element of `from`, which must not be empty.
    pub fn pick<T: Clone>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())].clone()
    }
}

/// Changes one to three places: flips bits, replaces bytes, writes notable numbers, removes,
/// inserts or overwrites runs of bytes, or truncates.
pub fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(3) {
        let at = random.below(bytes.len() + 1);
        let end = at + random.below((bytes.len() - at).min(LONGEST_RUN) + 1);
        match random.below(8) {
            0 | 1 => bytes[at.saturating_sub(1)..at].iter_mut().for_each(|byte| *byte ^= 1 << random.below(8)),
            2 => bytes[at..end].iter_mut().for_each(|byte| *byte = random.below(256) as u8),
            3 | 4 => write_notable(bytes, at, 1 << random.below(4), random),
            5 => drop(bytes.drain(at..end)),
            6 => {
                let run = bytes[at..end].to_vec();
                let to = random.below(bytes.len() + 1);
                let covered = if random.below(2) == 0 { to } else { (to + run.len()).min(bytes.len()) };
                bytes.splice(to..covered, run);
            }
            _ => bytes.truncate(at),
        }
    }
}

/// Writes the low `width` bytes of a notable number at `at`, as far as there is room.
pub fn write_notable(bytes: &mut [u8], at: usize, width: usize, random: &mut Random) {
    let number = random.pick(&NOTABLE).to_le_bytes();
    bytes.iter_mut().skip(at).zip(&number[..width]).for_each(|(byte, &new)| *byte = new);
}

/// Changes one or two lines: removes, duplicates or swaps them, or replaces a word by a number, one
/// of `words` or another word of the text. In one case of four it damages bytes as well.
pub fn damage_text(text: &str, words: &str, random: &mut Random) -> Vec<u8> {
    let all: Vec<&str> = text.split_whitespace().collect();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..=random.below(2) {
        let [at, other] = [random.below(lines.len()), random.below(lines.len())];
        match random.below(8) {
            0 => drop(lines.remove(at)),
            1 => lines.insert(other, lines[at].clone()),
            2 => lines.swap(at, other),
            kind => {
                let mut line: Vec<&str> = lines[at].split_whitespace().collect();
                let word = if kind % 3 == 2 { random.pick(&all) } else { random.word([NUMBERS, words][kind % 3]) };
                let place = random.below(line.len() + 1);
                line.splice(place..(place + 1).min(line.len()), [word]);
                lines[at] = line.join(" ");
            }
        }
    }
    let mut bytes = lines.join("\n").into_bytes();
    if random.below(4) == 0 {
        damage(&mut bytes, random);
    }
    bytes
}

/// Changes one to three values: replaces them by a number, one of `words` or a copy of another
/// value, or removes or adds elements.
pub fn damage_json(json: &mut Value, words: &str, random: &mut Random) {
    for _ in 0..=random.below(3) {
        let places = places(json);
        let other = json.pointer(&random.pick(&places)).cloned().unwrap_or_default();
        let Some(value) = json.pointer_mut(&random.pick(&places)) else { continue };
        match (random.below(5), &mut *value) {
            (0, _) => *value = other,
            (1, Value::Array(values)) if !values.is_empty() => drop(values.remove(random.below(values.len()))),
            (1, Value::Object(members)) => members.retain(|_, _| random.below(4) > 0),
            (2, Value::Array(values)) => values.push(other),
            (2, Value::Object(members)) => drop(members.insert(random.word(words).to_owned(), other)),
            (3, Value::Number(number)) => *value = json!((number.as_f64().unwrap_or(0.0) as i64).saturating_add(1)),
            (4, _) => *value = json!(random.word(words)),
            _ => *value = serde_json::from_str(random.word(NUMBERS)).unwrap_or_default(),
        }
    }
}

/// JSON pointers to a value and to everything in it.
fn places(json: &Value) -> Vec<String> {
    let inner: Vec<(String, &Value)> = match json {
        Value::Array(values) => values.iter().enumerate().map(|(i, value)| (i.to_string(), value)).collect(),
        Value::Object(members) => members.iter().map(|(key, value)| (key.clone(), value)).collect(),
        _ => Vec::new(),
    };
    let deeper = inner.iter().flat_map(|(key, value)| places(value).into_iter().map(move |p| format!("/{key}{p}")));
    [String::new()].into_iter().chain(deeper).collect()
}
