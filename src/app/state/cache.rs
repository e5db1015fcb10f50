//! [`Cache`]: values by recipe within a budget of bytes.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Values by recipe; the least recently used go first when the budget is exceeded.
///
/// Reading marks a value as used through a shared reference, so views can do it.
#[derive(Debug)]
pub struct Cache<K, V> {
    /// By key. No tree: there are a score of kinds of caches, and each tree costs seconds of the build.
    entries: Vec<(K, Entry<V>)>,
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

impl<K: Ord, V> Cache<K, V> {
    /// An empty cache that holds at most `budget` bytes (one value larger than that is kept until the next).
    pub fn new(budget: usize) -> Self {
        Self { entries: Vec::new(), bytes: 0, budget, clock: AtomicU64::new(0) }
    }

    /// The value of `key`, now the most recently used.
    pub fn get(&self, key: &K) -> Option<&Arc<V>> {
        let (_, entry) = &self.entries[self.find(key).ok()?];
        entry.used.store(self.tick(), Ordering::Relaxed);
        Some(&entry.value)
    }

    /// All values with their keys; none of them counts as used.
    pub fn iter(&self) -> impl Iterator<Item = (&K, &Arc<V>)> {
        self.entries.iter().map(|(key, entry)| (key, &entry.value))
    }

    /// True where `key` has a value.
    pub fn contains(&self, key: &K) -> bool {
        self.find(key).is_ok()
    }

    /// Stores a value that holds `bytes`, and drops old ones until the budget is kept.
    pub fn insert(&mut self, key: K, value: Arc<V>, bytes: usize) {
        let entry = Entry { value, bytes, used: AtomicU64::new(self.tick()) };
        match self.find(&key) {
            Ok(at) => self.bytes -= std::mem::replace(&mut self.entries[at].1, entry).bytes,
            Err(at) => self.entries.insert(at, (key, entry)),
        }
        self.bytes += bytes;
        while self.bytes > self.budget && self.entries.len() > 1 {
            let used = |at: &usize| self.entries[*at].1.used.load(Ordering::Relaxed);
            let Some(oldest) = (0..self.entries.len()).min_by_key(used) else { break };
            self.bytes -= self.entries.remove(oldest).1.bytes;
        }
    }

    /// Drops what does not fulfil `keep`.
    pub fn retain(&mut self, mut keep: impl FnMut(&K) -> bool) {
        self.entries.retain(|(key, entry)| {
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

    /// Position of a key, or that where it would be.
    fn find(&self, key: &K) -> Result<usize, usize> {
        self.entries.binary_search_by(|(own, _)| own.cmp(key))
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
