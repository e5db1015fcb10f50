//! [`Cache`]: values by recipe within a budget of bytes.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Values by recipe; the least recently used go first when the budget is exceeded.
///
/// Reading marks a value as used through a shared reference, so views can do it.
#[derive(Debug)]
pub struct Cache<K, V> {
    entries: BTreeMap<K, Entry<V>>,
    bytes: usize,
    budget: usize,
    clock: AtomicU64,
}

#[derive(Debug)]
struct Entry<V> {
    value: Arc<V>,
    bytes: usize,
    used: AtomicU64,
}

impl<K: Ord + Clone, V> Cache<K, V> {
    /// An empty cache that holds at most `budget` bytes (one value larger than that is kept until the next).
    pub fn new(budget: usize) -> Self {
        Self { entries: BTreeMap::new(), bytes: 0, budget, clock: AtomicU64::new(0) }
    }

    /// The value of `key`, now the most recently used.
    pub fn get(&self, key: &K) -> Option<&Arc<V>> {
        let entry = self.entries.get(key)?;
        entry.used.store(self.tick(), Ordering::Relaxed);
        Some(&entry.value)
    }

    /// All values with their keys; none of them counts as used.
    pub fn iter(&self) -> impl Iterator<Item = (&K, &Arc<V>)> {
        self.entries.iter().map(|(key, entry)| (key, &entry.value))
    }

    /// True where `key` has a value.
    pub fn contains(&self, key: &K) -> bool {
        self.entries.contains_key(key)
    }

    /// Stores a value that holds `bytes`, and drops old ones until the budget is kept.
    pub fn insert(&mut self, key: K, value: Arc<V>, bytes: usize) {
        let used = AtomicU64::new(self.tick());
        if let Some(old) = self.entries.insert(key, Entry { value, bytes, used }) {
            self.bytes -= old.bytes;
        }
        self.bytes += bytes;
        while self.bytes > self.budget && self.entries.len() > 1 {
            let oldest =
                self.entries.iter().min_by_key(|(_, e)| e.used.load(Ordering::Relaxed)).map(|(k, _)| k.clone());
            let Some(entry) = oldest.and_then(|key| self.entries.remove(&key)) else {
                break;
            };
            self.bytes -= entry.bytes;
        }
    }

    /// Drops what does not fulfil `keep`.
    pub fn retain(&mut self, mut keep: impl FnMut(&K) -> bool) {
        self.entries.retain(|key, entry| {
            let kept = keep(key);
            if !kept {
                self.bytes -= entry.bytes;
            }
            kept
        });
    }

    /// Drops everything.
    pub fn clear(&mut self) {
        self.entries.clear();
        self.bytes = 0;
    }

    /// Values held.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// True where nothing is held.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    fn tick(&self) -> u64 {
        self.clock.fetch_add(1, Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_recently_used_go_first() {
        let mut cache: Cache<u32, u32> = Cache::new(30);
        for k in 0..3 {
            cache.insert(k, Arc::new(k), 10);
        }
        assert!(cache.get(&0).is_some());
        cache.insert(3, Arc::new(3), 10);
        assert!(cache.contains(&0) && !cache.contains(&1) && cache.contains(&2) && cache.contains(&3));
        assert_eq!(cache.bytes(), 30);
        cache.insert(3, Arc::new(4), 5);
        assert_eq!(cache.bytes(), 25);
        cache.insert(9, Arc::new(9), 100);
        assert_eq!((cache.len(), cache.bytes()), (1, 100));
        cache.retain(|_| false);
        assert_eq!((cache.len(), cache.bytes()), (0, 0));
    }
}
