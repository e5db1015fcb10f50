//! Cost of a `.pt` file in memory, found before anything of it is unpickled.
//!
//! A pickle is a program for a stack machine: a byte of it makes a value of a hundred bytes, a few bytes copy
//! everything made so far, and compression makes the program itself a thousand times smaller. This module walks through
//! the program without making its values and adds up what they would take. A program that is malformed is left to the
//! reader, which stops at the same place.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _};

/// Most bytes of the pickle itself. A dict of the twelve tensors of a touch has two thousand.
pub(super) const MAX_PICKLE: u64 = 1 << 20;
/// Most bytes that the values of the pickle may take in memory, tensors' contents not counted.
const MAX_COST: u64 = 64 << 20;
/// Most bytes of the dotted names of all tensors.
const MAX_NAMES: u64 = 16 << 20;
/// Most bytes of a compressed entry once it is unpacked. `torch.save` does not compress.
const MAX_UNPACKED: u64 = 64 << 20;
/// Bytes that a value is taken to cost beside its text: more than it does, with the spare room of growing lists and
/// tables.
const VALUE: u64 = 256;
/// Longest position in a list, as part of a tensor's name.
const POSITION: u64 = 20;

/// Bytes at the start of an old file, without a zip, that hold [`LEGACY_MAGIC`].
const LEGACY_WINDOW: usize = 64;
const LEGACY_MAGIC: [&[u8]; 2] =
    [&[0x6c, 0xfc, 0x9c, 0x46, 0xf9, 0x20, 0x6a, 0xa8, 0x50, 0x19], b"119547037146038801333356"];
/// Pickles before the values of an old file: magic number, version, system, the dict, the names of the storages.
const LEGACY_PICKLES: usize = 5;
const TAR_MAGIC: std::ops::Range<usize> = 257..262;

/// Refuses a file that would take more memory than a dict of tensors needs.
pub(super) fn check(mut file: File) -> Result<(), String> {
    let mut head = Vec::new();
    // Whatever cannot be read here cannot be read by the reader either, which says so.
    if (&mut file).take(2).read_to_end(&mut head).is_err() {
        return Ok(());
    }
    if head == b"PK" {
        return if file.rewind().is_ok() { zip(file) } else { Ok(()) };
    }
    if (&mut file).take(2 * MAX_PICKLE - 2).read_to_end(&mut head).is_err() {
        return Ok(());
    }
    if head.get(TAR_MAGIC) == Some(b"ustar") {
        return Err("it is a tar archive as PyTorch wrote before 2017".into());
    }
    let window = &head[..head.len().min(LEGACY_WINDOW)];
    let legacy = LEGACY_MAGIC.iter().any(|magic| window.windows(magic.len()).any(|w| w == *magic));
    let mut rest = head.as_slice();
    for _ in 0..if legacy { LEGACY_PICKLES } else { 1 } {
        match pickle(rest)? {
            Some(after) => rest = after,
            // Cut off at what was read, not by the file's end: the program goes on beyond the limit.
            None if head.len() as u64 == 2 * MAX_PICKLE && rest.len() as u64 > MAX_PICKLE => return Err(too_long()),
            None => return Ok(()),
        }
    }
    Ok(())
}

fn too_long() -> String {
    format!("its list of contents is longer than the {MAX_PICKLE} bytes that a dict of tensors needs")
}

fn zip(file: File) -> Result<(), String> {
    // A damaged archive is the reader's to name.
    let Ok(mut archive) = zip::ZipArchive::new(BufReader::new(file)) else { return Ok(()) };
    for index in 0..archive.len() {
        let Ok(entry) = archive.by_index_raw(index) else { return Ok(()) };
        let (size, stored) = (entry.size(), entry.compression() == zip::CompressionMethod::Stored);
        let name = String::from_utf8_lossy(entry.name_raw()).into_owned();
        drop(entry);
        if !stored && size > MAX_UNPACKED {
            let name = crate::io::files::clip(&name);
            return Err(format!("{name} would be unpacked to {size} bytes; at most {MAX_UNPACKED} are"));
        }
        if !name.ends_with("data.pkl") {
            continue;
        }
        if size > MAX_PICKLE {
            return Err(too_long());
        }
        let Ok(entry) = archive.by_index(index) else { return Ok(()) };
        let mut bytes = Vec::new();
        // Even a damaged entry is walked as far as it goes.
        entry.take(MAX_PICKLE).read_to_end(&mut bytes).ok();
        pickle(&bytes)?;
    }
    Ok(())
}

/// Properties of a value that its cost depends on.
#[derive(Clone, Copy, Default)]
struct Weight {
    /// Bytes in memory.
    bytes: u64,
    /// Tensors in it.
    tensors: u64,
    /// Bytes of their names below this value.
    names: u64,
    /// Length, if it is a text.
    text: u64,
    /// Number under which the program keeps it for later.
    memo: Option<u32>,
}

impl Weight {
    /// A container of these; each may be the key of any other.
    fn of(items: &[Self]) -> Self {
        let longest = items.iter().map(|item| item.text).max().unwrap_or(0).max(POSITION);
        let sum = |part: fn(&Self) -> u64| items.iter().fold(0u64, |sum, item| sum.saturating_add(part(item)));
        let tensors = sum(|item| item.tensors);
        let names = sum(|item| item.names).saturating_add(tensors.saturating_mul(longest + 1));
        Self { bytes: sum(|item| item.bytes), tensors, names, text: 0, memo: None }
    }
}

/// Why the walk ended before the program did.
enum End {
    /// The program makes no sense from here on.
    Malformed,
    /// It costs too much.
    Cost,
}

/// Walks through one pickle. What follows it, or `None` where it is malformed.
pub(super) fn pickle(bytes: &[u8]) -> Result<Option<&[u8]>, String> {
    let mut walk = Walk { rest: bytes, stack: Vec::new(), marks: Vec::new(), memo: HashMap::new(), spent: 0 };
    loop {
        match walk.step() {
            Ok(false) if bytes.len() - walk.rest.len() > MAX_PICKLE as usize => return Err(too_long()),
            Ok(false) => {}
            Ok(true) if walk.stack.last().is_some_and(|top| top.names > MAX_NAMES) => break,
            Ok(true) => return Ok(Some(walk.rest)),
            Err(End::Malformed) => return Ok(None),
            Err(End::Cost) => break,
        }
    }
    Err(format!("{} bytes of it describe values that would take more than {} MiB", bytes.len(), MAX_COST >> 20))
}

struct Walk<'a> {
    rest: &'a [u8],
    stack: Vec<Weight>,
    marks: Vec<usize>,
    memo: HashMap<u32, Weight>,
    spent: u64,
}

impl Walk<'_> {
    fn take(&mut self, count: u64) -> Result<&[u8], End> {
        let count = usize::try_from(count).map_err(|_| End::Malformed)?;
        let (head, tail) = self.rest.split_at_checked(count).ok_or(End::Malformed)?;
        self.rest = tail;
        Ok(head)
    }

    /// A little-endian number of so many bytes.
    fn number(&mut self, bytes: u64) -> Result<u64, End> {
        Ok(self.take(bytes)?.iter().rev().fold(0, |value, &byte| value << 8 | u64::from(byte)))
    }

    fn line(&mut self) -> Result<&[u8], End> {
        let end = self.rest.iter().position(|&byte| byte == b'\n').ok_or(End::Malformed)?;
        let line = self.take(end as u64 + 1)?;
        Ok(&line[..end])
    }

    fn slot_of_line(&mut self) -> Result<u32, End> {
        let line = self.line()?;
        std::str::from_utf8(line).ok().and_then(|text| text.trim_end_matches('\r').parse().ok()).ok_or(End::Malformed)
    }

    fn charge(&mut self, bytes: u64) -> Result<(), End> {
        self.spent = self.spent.saturating_add(bytes);
        if self.spent > MAX_COST { Err(End::Cost) } else { Ok(()) }
    }

    /// A value with a text (or bytes) of this length.
    fn push(&mut self, text: u64) -> Result<(), End> {
        let bytes = VALUE.saturating_add(text.saturating_mul(2));
        self.charge(bytes)?;
        self.stack.push(Weight { bytes, text, ..Weight::default() });
        Ok(())
    }

    /// Skips a text whose length stands before it in so many bytes.
    fn push_sized(&mut self, length_bytes: u64) -> Result<(), End> {
        let length = self.number(length_bytes)?;
        self.take(length)?;
        self.push(length)
    }

    fn push_container(&mut self, items: &[Weight]) -> Result<(), End> {
        self.charge(VALUE)?;
        let mut weight = Weight::of(items);
        weight.bytes = weight.bytes.saturating_add(VALUE);
        self.stack.push(weight);
        Ok(())
    }

    fn push_copy(&mut self, of: Option<Weight>) -> Result<(), End> {
        let copy = of.ok_or(End::Malformed)?;
        self.charge(copy.bytes)?;
        self.stack.push(copy);
        Ok(())
    }

    fn mark_on_top(&self) -> bool {
        self.marks.last() == Some(&self.stack.len())
    }

    fn pop(&mut self) -> Result<Weight, End> {
        if self.mark_on_top() { Err(End::Malformed) } else { self.stack.pop().ok_or(End::Malformed) }
    }

    fn pop_to_mark(&mut self) -> Result<Vec<Weight>, End> {
        let mark = self.marks.pop().ok_or(End::Malformed)?;
        Ok(self.stack.split_off(mark))
    }

    /// Puts the values into the container on top.
    fn add(&mut self, items: &[Weight]) -> Result<(), End> {
        let more = Weight::of(items);
        let mut top = self.pop()?;
        top.bytes = top.bytes.saturating_add(more.bytes);
        top.tensors = top.tensors.saturating_add(more.tensors);
        top.names = top.names.saturating_add(more.names);
        self.stack.push(top);
        Ok(())
    }

    fn put(&mut self, slot: u32) -> Result<(), End> {
        let mut top = self.pop()?;
        self.charge(top.bytes)?;
        top.memo = Some(slot);
        self.stack.push(top);
        self.memo.insert(slot, top);
        Ok(())
    }

    fn get(&mut self, slot: u64) -> Result<(), End> {
        let kept = u32::try_from(slot).ok().and_then(|slot| self.memo.get(&slot).copied());
        self.push_copy(kept)
    }

    /// One opcode; `true` at the end of the program. The letters are those of Python's `pickletools`.
    fn step(&mut self) -> Result<bool, End> {
        let [op] = *self.take(1)? else { return Err(End::Malformed) };
        match op {
            b'.' => return Ok(true),
            // PROTO and FRAME.
            0x80 => self.take(1).map(drop)?,
            0x95 => self.take(8).map(drop)?,
            b'N' | b')' | b']' | b'}' | 0x88 | 0x89 | 0x8f => self.push(0)?,
            b'J' => self.take(4).map(drop).and_then(|()| self.push(0))?,
            b'K' => self.take(1).map(drop).and_then(|()| self.push(0))?,
            b'M' => self.take(2).map(drop).and_then(|()| self.push(0))?,
            b'G' => self.take(8).map(drop).and_then(|()| self.push(0))?,
            // Text in Latin-1 takes up to twice its bytes.
            b'I' | b'L' | b'F' | b'V' | b'P' => {
                let length = 2 * self.line()?.len() as u64;
                self.push(length)?;
            }
            0x8a | 0x8c | b'U' | b'C' => self.push_sized(1)?,
            0x8b | b'X' | b'T' | b'B' => self.push_sized(4)?,
            0x8d | 0x8e | 0x96 => self.push_sized(8)?,
            b'c' => {
                let length = self.line()?.len() as u64 + self.line()?.len() as u64; // GLOBAL
                self.push(length)?;
            }
            b'(' => {
                self.charge(VALUE)?;
                self.marks.push(self.stack.len());
            }
            b't' | b'l' | b'd' | 0x91 => self.pop_to_mark().and_then(|items| self.push_container(&items))?,
            0x85 | b'Q' => self.combine(1, 0)?,        // TUPLE1, BINPERSID
            0x86 | 0x93 | 0x81 => self.combine(2, 0)?, // TUPLE2, STACK_GLOBAL, NEWOBJ
            0x87 | 0x92 => self.combine(3, 0)?,        // TUPLE3, NEWOBJ_EX
            b'R' => self.combine(2, 1)?,               // REDUCE: the call may make a tensor
            b'a' => self.pop().and_then(|item| self.add(&[item]))?,
            b'e' | b'u' | 0x90 => self.pop_to_mark().and_then(|items| self.add(&items))?,
            b's' => {
                let (value, key) = (self.pop()?, self.pop()?);
                self.add(&[key, value])?;
            }
            b'0' if self.mark_on_top() => {
                self.marks.pop();
            }
            b'0' => self.pop().map(drop)?,
            b'1' => self.pop_to_mark().map(drop)?,
            b'2' => {
                let top = if self.mark_on_top() { None } else { self.stack.last().copied() };
                self.push_copy(top)?;
            }
            b'g' => self.slot_of_line().and_then(|slot| self.get(slot.into()))?,
            b'h' => self.number(1).and_then(|slot| self.get(slot))?,
            b'j' => self.number(4).and_then(|slot| self.get(slot))?,
            b'p' => self.slot_of_line().and_then(|slot| self.put(slot))?,
            b'q' => self.number(1).and_then(|slot| self.put(slot as u32))?,
            b'r' => self.number(4).and_then(|slot| self.put(slot as u32))?,
            0x94 => self.put(self.memo.len() as u32)?,
            b'b' => self.build()?,
            _ => return Err(End::Malformed),
        }
        Ok(false)
    }

    /// The topmost values become one.
    fn combine(&mut self, count: usize, tensors: u64) -> Result<(), End> {
        let items = (0..count).map(|_| self.pop()).collect::<Result<Vec<_>, _>>()?;
        self.push_container(&items)?;
        if let Some(top) = self.stack.last_mut() {
            top.tensors = top.tensors.saturating_add(tensors);
        }
        Ok(())
    }

    /// BUILD: the state goes into the object, and into its copy that is kept.
    fn build(&mut self) -> Result<(), End> {
        let state = self.pop()?;
        let object = self.pop()?;
        let built = Weight { memo: object.memo, ..Weight::of(&[object, state]) };
        if let Some(slot) = object.memo {
            self.charge(built.bytes)?;
            self.memo.insert(slot, built);
        }
        self.stack.push(Weight { memo: None, ..built });
        Ok(())
    }
}
