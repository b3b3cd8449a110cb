//! The tables of a crate file: tokens, strings, fields, sets of fields, paths and specs.

use super::Rep;
use super::coding::{decode_ints, decompress};
use crate::format::bytes::{Broken, Bytes};
use std::collections::BTreeMap;

/// Newest minor version that is read; later ones may have new types of values, which are refused one by one.
pub(super) const NEWEST: u8 = 13;

/// A prim or property by its number in the table of paths.
pub(super) type Node = u32;

/// Reads a section that starts at the given byte of the file.
type Parse = fn(&mut Tables, Bytes, u64) -> Result<(), Broken>;

/// The sections of a file in the order in which they build on each other.
pub(super) const TABLES: [(&str, Parse); 6] = [
    ("TOKENS", Tables::read_tokens),
    ("STRINGS", Tables::read_strings),
    ("FIELDS", Tables::read_fields),
    ("FIELDSETS", Tables::read_sets),
    ("PATHS", Tables::read_paths),
    ("SPECS", Tables::read_specs),
];

/// Place of a prim or property in the tree.
#[derive(Clone, Copy)]
pub(super) struct PathNode {
    pub(super) parent: Option<Node>,
    pub(super) name: u32,
}

/// What a file says about its values.
#[derive(Default)]
pub(super) struct Tables {
    pub(super) version: [u8; 3],
    pub(super) tokens: Vec<String>,
    pub(super) token_numbers: BTreeMap<String, u32>,
    /// Token of each string.
    pub(super) strings: Vec<u32>,
    /// Token of the name, and value.
    pub(super) fields: Vec<(u32, Rep)>,
    /// Numbers of fields, every set with an end.
    pub(super) sets: Vec<u32>,
    pub(super) nodes: Vec<Option<PathNode>>,
    pub(super) root: Node,
    /// (parent, is a property, name) to node.
    pub(super) children: BTreeMap<(Node, bool, u32), Node>,
    /// First field of each node's set, and the kind of the node, for nodes that have a spec.
    pub(super) specs: Vec<Option<(u32, u32)>>,
}

impl Tables {
    /// True for versions 0.`minor` and newer.
    pub(super) fn at_least(&self, minor: u8) -> bool {
        self.version[0] > 0 || self.version[1] >= minor
    }

    fn read_tokens(&mut self, mut input: Bytes, _: u64) -> Result<(), Broken> {
        let count = input.u64()?;
        let size = input.u64()?;
        let text = if self.at_least(4) {
            let packed = input.u64()?;
            decompress(input.take(packed)?, size)?
        } else {
            input.take(size)?.to_vec()
        };
        for token in text.split_inclusive(|&b| b == 0) {
            let token = token.strip_suffix(&[0]).ok_or("the last token has no end")?;
            let token = str::from_utf8(token).map_err(|_| "a token is not UTF-8")?;
            self.token_numbers.entry(token.to_owned()).or_insert(self.tokens.len() as u32);
            self.tokens.push(token.to_owned());
        }
        match self.tokens.len() as u64 == count {
            true => Ok(()),
            false => Err(format!("{count} tokens are announced, {} are there", self.tokens.len())),
        }
    }

    fn read_strings(&mut self, mut input: Bytes, _: u64) -> Result<(), Broken> {
        let count = input.u64()?;
        let bytes = input.take(count.saturating_mul(4))?;
        self.strings = bytes.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
        Ok(())
    }

    fn read_fields(&mut self, mut input: Bytes, _: u64) -> Result<(), Broken> {
        let count = input.u64()?;
        if !self.at_least(4) {
            let mut rows = Bytes::new(input.take(count.saturating_mul(16))?);
            for _ in 0..count {
                rows.u32()?;
                self.fields.push((rows.u32()?, Rep(rows.u64()?)));
            }
            return Ok(());
        }
        let names = read_ints(&mut input, count)?;
        let packed = input.u64()?;
        let reps = decompress(input.take(packed)?, count.saturating_mul(8))?;
        let reps = reps.as_chunks::<8>().0;
        if reps.len() != names.len() {
            return Err(format!("{count} values are announced, {} are there", reps.len()));
        }
        self.fields = names.iter().zip(reps).map(|(&n, r)| (n as u32, Rep(u64::from_le_bytes(*r)))).collect();
        Ok(())
    }

    fn read_sets(&mut self, mut input: Bytes, _: u64) -> Result<(), Broken> {
        let count = input.u64()?;
        self.sets = if self.at_least(4) {
            read_ints(&mut input, count)?.iter().map(|&i| i as u32).collect()
        } else {
            let bytes = input.take(count.saturating_mul(4))?;
            bytes.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect()
        };
        Ok(())
    }

    fn read_paths(&mut self, mut input: Bytes, start: u64) -> Result<(), Broken> {
        let whole = input;
        let count = input.u64()?;
        // (path, name, is a property, jump) of the entries in file order
        let mut stack: Vec<(u64, Option<Node>)> = vec![];
        if self.at_least(4) {
            let encoded = input.u64()?;
            let paths = read_ints(&mut input, encoded)?;
            let names = read_ints(&mut input, encoded)?;
            let jumps = read_ints(&mut input, encoded)?;
            if count > encoded * 2 + 16 {
                return Err(format!("{count} paths are announced, {encoded} are there"));
            }
            self.nodes = vec![None; count as usize];
            stack.push((0, None));
            while let Some((mut i, mut parent)) = stack.pop() {
                loop {
                    let k = usize::try_from(i).ok().filter(|&k| k < paths.len()).ok_or("a path is out of range")?;
                    let node = paths[k] as u32;
                    self.add_path(node, parent, names[k].unsigned_abs() as u32, names[k] < 0)?;
                    let (child, sibling) = (jumps[k] > 0 || jumps[k] == -1, jumps[k] >= 0);
                    if child && sibling {
                        stack.push((i + jumps[k] as u64, parent));
                    }
                    if child {
                        parent = Some(node);
                    }
                    if !(child || sibling) {
                        break;
                    }
                    i += 1;
                }
            }
            return Ok(());
        }
        // Old layout: records one after the other; one with child and sibling is followed by the sibling's offset.
        let record = if self.version == [0, 0, 1] { 16 } else { 12 };
        if count > whole.rest().len() as u64 {
            return Err(format!("{count} paths are announced"));
        }
        self.nodes = vec![None; count as usize];
        stack.push((8, None));
        while let Some((at, mut parent)) = stack.pop() {
            let mut input = whole;
            input.take(at)?;
            loop {
                let mut row = Bytes::new(input.take(record)?);
                if record == 16 {
                    row.u32()?;
                }
                let (node, name, bits) = (row.u32()?, row.u32()?, row.u8()?);
                self.add_path(node, parent, name, bits & 4 != 0)?;
                let (child, sibling) = (bits & 1 != 0, bits & 2 != 0);
                if child && sibling {
                    let at = input.u64()?.checked_sub(start).ok_or("a path is out of range")?;
                    stack.push((at, parent));
                }
                if child {
                    parent = Some(node);
                }
                if !(child || sibling) {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Takes a path into the tree. Every node can come once, so a broken tree ends.
    fn add_path(&mut self, node: Node, parent: Option<Node>, name: u32, property: bool) -> Result<(), Broken> {
        let slot = self.nodes.get_mut(node as usize).ok_or("a path has a number out of range")?;
        if slot.is_some() {
            return Err(format!("path {node} comes twice"));
        }
        *slot = Some(PathNode { parent, name });
        match parent {
            None => self.root = node,
            Some(p) => drop(self.children.insert((p, property, name), node)),
        }
        Ok(())
    }

    fn read_specs(&mut self, mut input: Bytes, _: u64) -> Result<(), Broken> {
        let count = input.u64()?;
        let (mut paths, mut sets, mut kinds) = (vec![], vec![], vec![]);
        if self.at_least(4) {
            paths = read_ints(&mut input, count)?;
            sets = read_ints(&mut input, count)?;
            kinds = read_ints(&mut input, count)?;
        } else {
            let padded = self.version == [0, 0, 1];
            let mut rows = Bytes::new(input.take(count.saturating_mul(if padded { 16 } else { 12 }))?);
            for _ in 0..count {
                if padded {
                    rows.u32()?;
                }
                for column in [&mut paths, &mut sets, &mut kinds] {
                    column.push(i64::from(rows.u32()?));
                }
            }
        }
        self.specs = vec![None; self.nodes.len()];
        for ((path, set), kind) in paths.into_iter().zip(sets).zip(kinds) {
            let slot = usize::try_from(path).ok().and_then(|p| self.specs.get_mut(p));
            *slot.ok_or("a spec has a path out of range")? = Some((set as u32, kind as u32));
        }
        Ok(())
    }
}

fn read_ints(input: &mut Bytes, count: u64) -> Result<Vec<i64>, Broken> {
    let size = input.u64()?;
    decode_ints(input.take(size)?, count, false)
}
