//! A streaming writer of crate files, version 0.8.0: the newest layout that every host of the last years reads.

use super::coding::{compress, encode_ints};
use super::{BOOTSTRAP, END_OF_SET, MAGIC, Rep, Type, spec};
use bytemuck::Pod;
use std::collections::BTreeMap;
use std::io::{BufWriter, Result, Seek, SeekFrom, Write};

/// Numbers and vectors that arrays are made of.
pub(super) trait Element: Pod {
    const TYPE: Type;
}

macro_rules! element {
    ($($t:ty => $kind:ident),*) => { $(impl Element for $t { const TYPE: Type = Type::$kind; })* };
}
element!(i32 => Int, i64 => Int64, f32 => Float, [f32; 2] => Vec2f, [f32; 3] => Vec3f);

/// A prim or a property; index into the writer's tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node(usize);

struct NodeData {
    name: u32,
    kind: u32,
    children: Vec<usize>,
    fields: Vec<(u32, Rep)>,
}

/// Writes values as they come and remembers the tree of prims for [`CrateWriter::finish`].
pub(super) struct CrateWriter<W: Write + Seek> {
    out: BufWriter<W>,
    at: u64,
    tokens: Vec<String>,
    token_index: BTreeMap<String, u32>,
    strings: Vec<u32>,
    string_index: BTreeMap<u32, u32>,
    nodes: Vec<NodeData>,
}

impl<W: Write + Seek> CrateWriter<W> {
    /// Starts a file. Until [`CrateWriter::finish`] its head is zero, so that nothing takes it for a whole one.
    pub(super) fn new(out: W) -> Result<Self> {
        let mut writer = CrateWriter {
            out: BufWriter::with_capacity(1 << 20, out),
            at: 0,
            tokens: Vec::new(),
            token_index: BTreeMap::new(),
            strings: Vec::new(),
            string_index: BTreeMap::new(),
            nodes: Vec::new(),
        };
        writer.put(&[0; BOOTSTRAP as usize])?;
        // Names of properties are stored as negative numbers, so number 0 must not be one.
        let dummy = writer.token_number(";-)");
        writer.nodes.push(NodeData { name: dummy, kind: spec::ROOT, children: vec![], fields: vec![] });
        Ok(writer)
    }

    /// The root that holds the facts of the layer and the prims.
    pub(super) fn root(&self) -> Node {
        Node(0)
    }

    /// Adds a prim; names of children of one node must differ.
    pub(super) fn prim(&mut self, parent: Node, name: &str, type_name: &str) -> Node {
        let node = self.node(parent, name, spec::PRIM);
        self.field(node, "specifier", Rep::inline(Type::Specifier, 0));
        let type_name = self.token(type_name);
        self.field(node, "typeName", type_name);
        node
    }

    /// Adds an attribute to a prim.
    pub(super) fn attribute(&mut self, prim: Node, name: &str, type_name: &str) -> Node {
        let node = self.node(prim, name, spec::ATTRIBUTE);
        let type_name = self.token(type_name);
        self.field(node, "typeName", type_name);
        node
    }

    /// Adds a uniform attribute with one value.
    pub(super) fn uniform(&mut self, prim: Node, name: &str, type_name: &str, value: Rep) {
        let node = self.attribute(prim, name, type_name);
        self.field(node, "variability", Rep::inline(Type::Variability, 1));
        self.field(node, "default", value);
    }

    /// Sets a field of a node.
    pub(super) fn field(&mut self, node: Node, name: &str, value: Rep) {
        let name = self.token_number(name);
        self.nodes[node.0].fields.push((name, value));
    }

    fn node(&mut self, parent: Node, name: &str, kind: u32) -> Node {
        let index = self.nodes.len();
        let name = self.token_number(name);
        self.nodes.push(NodeData { name, kind, children: vec![], fields: vec![] });
        self.nodes[parent.0].children.push(index);
        Node(index)
    }

    fn token_number(&mut self, text: &str) -> u32 {
        if let Some(&i) = self.token_index.get(text) {
            return i;
        }
        let i = self.tokens.len() as u32;
        self.tokens.push(text.to_owned());
        self.token_index.insert(text.to_owned(), i);
        i
    }

    /// A token value.
    pub(super) fn token(&mut self, text: &str) -> Rep {
        Rep::inline(Type::Token, self.token_number(text))
    }

    fn string_number(&mut self, text: &str) -> u32 {
        // The tables end every token with a zero byte, so text cannot hold one.
        let token = self.token_number(&text.replace('\0', "\u{fffd}"));
        let next = self.strings.len() as u32;
        *self.string_index.entry(token).or_insert_with(|| {
            self.strings.push(token);
            next
        })
    }

    /// A string value.
    pub(super) fn string(&mut self, text: &str) -> Rep {
        Rep::inline(Type::String, self.string_number(text))
    }

    /// A double value.
    pub(super) fn double(&mut self, value: f64) -> Result<Rep> {
        let single = value as f32;
        if f64::from(single).to_bits() == value.to_bits() {
            return Ok(Rep::inline(Type::Double, single.to_bits()));
        }
        self.align()?;
        Ok(Rep::at(Type::Double, self.put(&value.to_le_bytes())?))
    }

    /// A vector of three doubles.
    pub(super) fn double3(&mut self, value: [f64; 3]) -> Result<Rep> {
        self.align()?;
        Ok(Rep::at(Type::Vec3d, self.put(bytemuck::bytes_of(&value))?))
    }

    /// An array; its bytes go out as they lie in memory.
    pub(super) fn array<T: Element>(&mut self, values: &[T]) -> Result<Rep> {
        self.counted(values).map(|at| Rep::array(T::TYPE, at))
    }

    /// An array of tokens.
    pub(super) fn token_array(&mut self, names: &[&str]) -> Result<Rep> {
        let numbers: Vec<u32> = names.iter().map(|n| self.token_number(n)).collect();
        self.counted(&numbers).map(|at| Rep::array(Type::Token, at))
    }

    /// A dictionary of values.
    pub(super) fn dictionary(&mut self, entries: &[(String, Rep)]) -> Result<Rep> {
        let keys: Vec<u32> = entries.iter().map(|(key, _)| self.string_number(key)).collect();
        self.align()?;
        let at = self.put(&(entries.len() as u64).to_le_bytes())?;
        for (key, (_, value)) in keys.iter().zip(entries) {
            self.put(&key.to_le_bytes())?;
            self.put_jump(*value)?;
        }
        Ok(Rep::at(Type::Dictionary, at))
    }

    /// Times that several attributes share.
    pub(super) fn times(&mut self, times: &[f64]) -> Result<Rep> {
        self.counted(times).map(|at| Rep::at(Type::DoubleVector, at))
    }

    /// One value for each of `times`.
    pub(super) fn time_samples(&mut self, times: Rep, values: &[Rep]) -> Result<Rep> {
        self.align()?;
        let at = self.put_jump(times)?;
        self.put(&8i64.to_le_bytes())?;
        self.put(&(values.len() as u64).to_le_bytes())?;
        self.put(bytemuck::cast_slice(values))?;
        Ok(Rep::at(Type::TimeSamples, at))
    }

    /// A value behind a jump over what it is made of; here that is already written, so the jump is over itself.
    fn put_jump(&mut self, value: Rep) -> Result<u64> {
        let at = self.put(&8i64.to_le_bytes())?;
        self.put(bytemuck::bytes_of(&value))?;
        Ok(at)
    }

    fn counted<T: Pod>(&mut self, values: &[T]) -> Result<u64> {
        if values.is_empty() {
            return Ok(0);
        }
        self.align()?;
        let at = self.put(&(values.len() as u64).to_le_bytes())?;
        self.put(bytemuck::cast_slice(values))?;
        Ok(at)
    }

    /// Writes bytes and returns where.
    fn put(&mut self, bytes: &[u8]) -> Result<u64> {
        let at = self.at;
        self.out.write_all(bytes)?;
        self.at += bytes.len() as u64;
        Ok(at)
    }

    fn align(&mut self) -> Result<()> {
        let gap = (8 - self.at % 8) % 8;
        self.put(&[0; 8][..gap as usize]).map(drop)
    }

    /// Writes the tables and the head. The file is whole when this returns; the bytes may still be on their way to
    /// the disk.
    pub(super) fn finish(mut self) -> Result<W> {
        self.name_children()?;
        let sections: [(&str, Vec<u8>); 6] = [
            ("TOKENS", self.token_table()),
            ("STRINGS", table_of_u32(&self.strings)),
            ("FIELDS", self.field_table()),
            ("FIELDSETS", self.field_set_table()),
            ("PATHS", self.path_table()),
            ("SPECS", self.spec_table()),
        ];
        let mut contents = (sections.len() as u64).to_le_bytes().to_vec();
        for (name, bytes) in sections {
            let mut label = [0u8; 16];
            label[..name.len()].copy_from_slice(name.as_bytes());
            let start = self.put(&bytes)?;
            contents.extend(label);
            contents.extend(start.to_le_bytes());
            contents.extend((bytes.len() as u64).to_le_bytes());
        }
        let contents_at = self.put(&contents)?;
        let mut out = self.out.into_inner().map_err(|e| e.into_error())?;
        out.seek(SeekFrom::Start(0))?;
        out.write_all(MAGIC)?;
        out.write_all(&[0, 8, 0, 0, 0, 0, 0, 0])?;
        out.write_all(&contents_at.to_le_bytes())?;
        out.flush()?;
        Ok(out)
    }

    /// Every node lists its prims and its properties by name.
    fn name_children(&mut self) -> Result<()> {
        for i in 0..self.nodes.len() {
            for (kind, field) in [(spec::PRIM, "primChildren"), (spec::ATTRIBUTE, "properties")] {
                let children = self.nodes[i].children.iter().map(|&c| &self.nodes[c]);
                let names: Vec<u32> = children.filter(|c| c.kind == kind).map(|c| c.name).collect();
                if !names.is_empty() {
                    let at = self.counted(&names)?;
                    self.field(Node(i), field, Rep::at(Type::TokenVector, at));
                }
            }
        }
        Ok(())
    }

    fn token_table(&self) -> Vec<u8> {
        let mut text = Vec::new();
        for token in &self.tokens {
            text.extend(token.as_bytes());
            text.push(0);
        }
        let mut out = (self.tokens.len() as u64).to_le_bytes().to_vec();
        out.extend((text.len() as u64).to_le_bytes());
        push_sized(&mut out, &compress(&text));
        out
    }

    /// Fields in the order of the nodes; no two nodes share one.
    fn field_table(&self) -> Vec<u8> {
        let (names, values): (Vec<i32>, Vec<Rep>) =
            self.nodes.iter().flat_map(|n| &n.fields).map(|&(name, value)| (name as i32, value)).unzip();
        let mut out = (names.len() as u64).to_le_bytes().to_vec();
        push_sized(&mut out, &encode_ints(&names));
        push_sized(&mut out, &compress(bytemuck::cast_slice(&values)));
        out
    }

    fn field_set_table(&self) -> Vec<u8> {
        let mut sets = Vec::new();
        let mut next = 0;
        for node in &self.nodes {
            sets.extend(next..next + node.fields.len() as i32);
            sets.push(END_OF_SET as i32);
            next += node.fields.len() as i32;
        }
        let mut out = (sets.len() as u64).to_le_bytes().to_vec();
        push_sized(&mut out, &encode_ints(&sets));
        out
    }

    /// The tree, depth first: for each node its number, its name (negative for properties) and where its next sibling
    /// is: so many entries on if there are children in between, 0 for "no child, sibling follows", -1 for "child, no
    /// sibling", -2 for neither.
    fn path_table(&self) -> Vec<u8> {
        let mut size = vec![1i32; self.nodes.len()];
        for i in (0..self.nodes.len()).rev() {
            size[i] += self.nodes[i].children.iter().map(|&c| size[c]).sum::<i32>();
        }
        let (mut paths, mut names, mut jumps) = (vec![], vec![], vec![]);
        let mut stack = vec![(0usize, false)];
        while let Some((i, has_sibling)) = stack.pop() {
            let node = &self.nodes[i];
            paths.push(i as i32);
            names.push(if node.kind == spec::ATTRIBUTE { -(node.name as i32) } else { node.name as i32 });
            jumps.push(match (node.children.is_empty(), has_sibling) {
                (false, true) => size[i],
                (false, false) => -1,
                (true, true) => 0,
                (true, false) => -2,
            });
            let last = node.children.last();
            stack.extend(node.children.iter().rev().map(|c| (*c, Some(c) != last)));
        }
        let count = (paths.len() as u64).to_le_bytes();
        let mut out = [count, count].concat();
        for column in [paths, names, jumps] {
            push_sized(&mut out, &encode_ints(&column));
        }
        out
    }

    fn spec_table(&self) -> Vec<u8> {
        let paths: Vec<i32> = (0..self.nodes.len() as i32).collect();
        let mut sets = vec![0];
        for node in &self.nodes {
            sets.push(sets[sets.len() - 1] + node.fields.len() as i32 + 1);
        }
        sets.pop();
        let kinds: Vec<i32> = self.nodes.iter().map(|n| n.kind as i32).collect();
        let mut out = (paths.len() as u64).to_le_bytes().to_vec();
        for column in [paths, sets, kinds] {
            push_sized(&mut out, &encode_ints(&column));
        }
        out
    }
}

fn push_sized(out: &mut Vec<u8>, bytes: &[u8]) {
    out.extend((bytes.len() as u64).to_le_bytes());
    out.extend(bytes);
}

fn table_of_u32(values: &[u32]) -> Vec<u8> {
    let mut out = (values.len() as u64).to_le_bytes().to_vec();
    out.extend_from_slice(bytemuck::cast_slice(values));
    out
}
