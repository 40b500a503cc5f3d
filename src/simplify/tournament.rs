//! Tournament tree: finds the least of many keys, a few of which change at a time.

/// Key of an entry; less is better. The second part breaks ties and must differ for every entry.
pub type Key = (i64, u64);

/// Key of an entry that does not take part.
pub const OUT: Key = (i64::MAX, u64::MAX);

/// A tournament tree. Changing a key costs one comparison for each match it decides, two on average
/// for a key that wins nothing.
#[derive(Debug, Clone)]
pub struct Tournament {
    keys: Vec<Key>,
    /// Winner of each match. Match 1 is the final, match m is between the winners of 2m and 2m + 1,
    /// and entry i takes place `keys.len() + i`.
    winners: Vec<u32>,
}

impl Tournament {
    /// Creates a tournament of `keys`.
    pub fn new(mut keys: Vec<Key>) -> Self {
        keys.resize(keys.len().next_power_of_two(), OUT);
        let entries = keys.len();
        let mut tournament = Self { keys, winners: vec![0; entries] };
        tournament.play_all();
        tournament
    }

    /// Changes all keys at once; `key` receives each entry and its key.
    pub fn set_all(&mut self, key: impl Fn(u32, Key) -> Key) {
        self.keys.iter_mut().zip(0..).for_each(|(old, entry)| *old = key(entry, *old));
        self.play_all();
    }

    fn play_all(&mut self) {
        for place in (1..self.keys.len()).rev() {
            self.winners[place] = self.play(place);
        }
    }

    /// Returns the entry with the least key.
    pub fn winner(&self) -> u32 {
        self.entrant(1)
    }

    /// Returns the key of an entry.
    pub fn key(&self, entry: u32) -> Key {
        self.keys[entry as usize]
    }

    /// Changes the key of an entry.
    pub fn set(&mut self, entry: u32, key: Key) {
        if self.keys[entry as usize] == key {
            return;
        }
        self.keys[entry as usize] = key;
        let mut place = (self.keys.len() + entry as usize) / 2;
        while place > 0 {
            let winner = self.play(place);
            if self.winners[place] == winner && winner != entry {
                break;
            }
            self.winners[place] = winner;
            place /= 2;
        }
    }

    fn entrant(&self, place: usize) -> u32 {
        if place < self.keys.len() { self.winners[place] } else { (place - self.keys.len()) as u32 }
    }

    fn play(&self, place: usize) -> u32 {
        let (left, right) = (self.entrant(2 * place), self.entrant(2 * place + 1));
        if self.keys[right as usize] < self.keys[left as usize] { right } else { left }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_winner_has_the_least_key_after_any_changes(
            keys in prop::collection::vec(-9..9_i64, 1..40),
            changes in prop::collection::vec((0..40_usize, -9..9_i64), 0..200),
        ) {
            let mut keys: Vec<Key> = keys.into_iter().zip(0..).collect();
            let mut tournament = Tournament::new(keys.clone());
            for (entry, value) in changes {
                let entry = entry % keys.len();
                keys[entry].0 = value;
                tournament.set(entry as u32, keys[entry]);
                let least = (0..keys.len()).min_by_key(|&i| keys[i]).unwrap();
                prop_assert_eq!(tournament.winner() as usize, least);
            }
        }
    }
}
