//! Captures kept in memory, up to the board's budget.

use firmware_core::{CaptureStore, StoreError, text};
use protocol_wire::{CaptureDescription, CaptureId, CaptureSummary, MAX_CAPTURES, PlaneKind};
use std::collections::{BTreeMap, HashMap};

/// The store. What it holds survives its camera: take it from [`crate::Running::stop`] and give it to the next.
#[derive(Debug)]
pub struct MemoryStore {
    limit_bytes: u64,
    captures: BTreeMap<CaptureId, Held>,
    /// How many cameras it has had after its first.
    restarts: u32,
}

#[derive(Debug)]
struct Held {
    bytes: u64,
    /// There once the capture is whole.
    description: Option<CaptureDescription>,
    strips: HashMap<(PlaneKind, u16), (Vec<u8>, u32)>,
}

impl MemoryStore {
    /// An empty store for `limit_bytes` bytes.
    #[must_use]
    pub fn new(limit_bytes: u64) -> Self {
        Self { limit_bytes, captures: BTreeMap::new(), restarts: 0 }
    }

    /// The name for the next capture: above all that are held.
    #[must_use]
    pub fn next_id(&self) -> CaptureId {
        self.captures.last_key_value().map_or(CaptureId(1), |(id, _)| CaptureId(id.0.wrapping_add(1)))
    }

    /// Number of captures held, whole or not.
    #[must_use]
    pub fn len(&self) -> usize {
        self.captures.len()
    }

    /// Whether nothing is held.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.captures.is_empty()
    }

    /// Forgets what was never finished, as a camera does when it starts again; says how often that was.
    pub(crate) fn restart(&mut self) -> u32 {
        self.captures.retain(|_, held| held.description.is_some());
        self.restarts += 1;
        self.restarts
    }
}

impl CaptureStore for MemoryStore {
    fn begin(&mut self, id: CaptureId, bytes: u64) -> Result<(), StoreError> {
        let free = self.free_bytes();
        if bytes > free {
            return Err(StoreError::Full { needed: bytes, free });
        }
        if self.captures.len() >= MAX_CAPTURES {
            return Err(StoreError::Failed(text("it holds as many captures as it can list; fetch some of them")));
        }
        self.captures.insert(id, Held { bytes, description: None, strips: HashMap::new() });
        Ok(())
    }

    fn write(
        &mut self,
        id: CaptureId,
        plane: PlaneKind,
        strip: u16,
        values: &[u8],
        crc: u32,
    ) -> Result<(), StoreError> {
        let held = self.captures.get_mut(&id).ok_or(StoreError::Missing)?;
        held.strips.insert((plane, strip), (values.to_vec(), crc));
        Ok(())
    }

    fn finish(&mut self, description: &CaptureDescription) -> Result<(), StoreError> {
        let held = self.captures.get_mut(&description.id).ok_or(StoreError::Missing)?;
        held.description = Some(description.clone());
        Ok(())
    }

    fn read(
        &mut self,
        id: CaptureId,
        plane: PlaneKind,
        strip: u16,
        values: &mut [u8],
    ) -> Result<(usize, u32), StoreError> {
        let held = self.captures.get(&id).ok_or(StoreError::Missing)?;
        let (kept, crc) = held.strips.get(&(plane, strip)).ok_or(StoreError::Missing)?;
        let room = values.get_mut(..kept.len()).ok_or_else(|| StoreError::Failed(text("a strip is too long")))?;
        room.copy_from_slice(kept);
        Ok((kept.len(), *crc))
    }

    fn describe(&mut self, id: CaptureId) -> Result<CaptureDescription, StoreError> {
        self.captures.get(&id).and_then(|held| held.description.clone()).ok_or(StoreError::Missing)
    }

    fn list(&mut self) -> heapless::Vec<CaptureSummary, MAX_CAPTURES> {
        self.captures
            .values()
            .filter_map(|held| {
                let description = held.description.as_ref()?;
                let frames = u8::try_from(description.frames.len()).unwrap_or(u8::MAX);
                Some(CaptureSummary { id: description.id, state: description.state, frames, bytes: held.bytes })
            })
            .collect()
    }

    fn remove(&mut self, id: CaptureId) -> Result<(), StoreError> {
        self.captures.remove(&id).map(|_| ()).ok_or(StoreError::Missing)
    }

    fn free_bytes(&self) -> u64 {
        let held: u64 = self.captures.values().map(|held| held.bytes).sum();
        self.limit_bytes.saturating_sub(held)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_counted_from_the_beginning_of_a_capture() {
        let mut store = MemoryStore::new(100);
        store.begin(CaptureId(1), 60).unwrap();
        assert_eq!(store.begin(CaptureId(2), 60), Err(StoreError::Full { needed: 60, free: 40 }));
        assert!(store.list().is_empty(), "it is not whole yet");
        store.remove(CaptureId(1)).unwrap();
        assert_eq!((store.free_bytes(), store.remove(CaptureId(1))), (100, Err(StoreError::Missing)));
    }

    #[test]
    fn no_more_is_held_than_can_be_listed() {
        let mut store = MemoryStore::new(100);
        for id in 0..16 {
            store.begin(CaptureId(id), 1).unwrap();
        }
        assert!(matches!(store.begin(CaptureId(16), 1), Err(StoreError::Failed(_))));
        assert_eq!(store.restart(), 1);
        assert!(store.is_empty(), "none was finished");
    }
}
