//! USD: hair as `BasisCurves` in binary files (`.usdc`, the "crate" format of OpenUSD, `pxr/usd/sdf/crateFile.cpp`).
//!
//! * [`UsdHair`] writes a shot frame by frame; what it writes is described there.
//! * [`verify`] reads such a file back and compares it with what should be in it.
//! * [`read_curves`] reads curves written by Pelage, by OpenUSD and by what uses it (Blender, Houdini, Maya).
//!
//! A crate file is a heap of values followed by tables: tokens (all names), fields (name and value), sets of fields,
//! paths (a tree of prims and properties) and specs (path, kind, set of fields). A value in a field is 8 bytes: type,
//! flags and either the value itself or the offset of its bytes. So values stream out as they come, and the tables are
//! written last.

mod coding;
mod curves;
mod hair;
mod read;
mod tables;
mod write;
mod xform;

pub use curves::{UsdCurves, UsdStage, read_curves};
pub use hair::{UsdHair, verify};

const _: () = assert!(cfg!(target_endian = "little"), "arrays are written as they lie in memory");

/// Types of values: the low byte of the top 16 bits of a [`Rep`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Type {
    Bool = 1,
    UChar = 2,
    Int = 3,
    UInt = 4,
    Int64 = 5,
    UInt64 = 6,
    Half = 7,
    Float = 8,
    Double = 9,
    String = 10,
    Token = 11,
    Matrix4d = 15,
    Quatd = 16,
    Quatf = 17,
    Quath = 18,
    Vec2d = 19,
    Vec2f = 20,
    Vec2h = 21,
    Vec2i = 22,
    Vec3d = 23,
    Vec3f = 24,
    Vec3h = 25,
    Vec3i = 26,
    Vec4d = 27,
    Vec4f = 28,
    Vec4h = 29,
    Vec4i = 30,
    Dictionary = 31,
    TokenVector = 41,
    Specifier = 42,
    Variability = 44,
    TimeSamples = 46,
    DoubleVector = 48,
    ValueBlock = 51,
}

impl Type {
    /// The type with this code, if it is one that curves need.
    fn from_code(code: u8) -> Option<Type> {
        use Type::*;
        let all = [
            Bool,
            UChar,
            Int,
            UInt,
            Int64,
            UInt64,
            Half,
            Float,
            Double,
            String,
            Token,
            Matrix4d,
            Quatd,
            Quatf,
            Quath,
            Vec2d,
            Vec2f,
            Vec2h,
            Vec2i,
            Vec3d,
            Vec3f,
            Vec3h,
            Vec3i,
            Vec4d,
            Vec4f,
            Vec4h,
            Vec4i,
            Dictionary,
            TokenVector,
            Specifier,
            Variability,
            TimeSamples,
            DoubleVector,
            ValueBlock,
        ];
        all.into_iter().find(|t| *t as u8 == code)
    }

    /// Kind of number and how many of them make one element, for types made of numbers.
    fn numbers(self) -> Option<(Number, usize)> {
        use Number::*;
        Some(match self {
            Type::Bool | Type::UChar => (U8, 1),
            Type::Int => (I32, 1),
            Type::UInt => (U32, 1),
            Type::Int64 => (I64, 1),
            Type::UInt64 => (U64, 1),
            Type::Half => (F16, 1),
            Type::Float => (F32, 1),
            Type::Double => (F64, 1),
            Type::Matrix4d => (F64, 16),
            Type::Quatd | Type::Vec4d => (F64, 4),
            Type::Quatf | Type::Vec4f => (F32, 4),
            Type::Quath | Type::Vec4h => (F16, 4),
            Type::Vec2d => (F64, 2),
            Type::Vec2f => (F32, 2),
            Type::Vec2h => (F16, 2),
            Type::Vec2i => (I32, 2),
            Type::Vec3d => (F64, 3),
            Type::Vec3f => (F32, 3),
            Type::Vec3h => (F16, 3),
            Type::Vec3i => (I32, 3),
            Type::Vec4i => (I32, 4),
            _ => return None,
        })
    }
}

/// Numbers that values are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    U8,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
}

impl Number {
    /// Bytes of one number.
    fn size(self) -> usize {
        match self {
            Number::U8 => 1,
            Number::F16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::I64 | Number::U64 | Number::F64 => 8,
        }
    }
}

/// A value of a field: type, flags and payload (the value itself, or the offset of its bytes) in 64 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
struct Rep(u64);

impl Rep {
    const ARRAY: u64 = 1 << 63;
    const INLINE: u64 = 1 << 62;
    const COMPRESSED: u64 = 1 << 61;
    /// An edit of an array rather than an array; newer than anything that is written here.
    const EDIT: u64 = 1 << 60;
    const PAYLOAD: u64 = (1 << 48) - 1;

    /// A value that fits into the payload.
    fn inline(kind: Type, payload: u32) -> Rep {
        Rep(Rep::INLINE | (kind as u64) << 48 | u64::from(payload))
    }

    /// A value whose bytes are at `offset`.
    fn at(kind: Type, offset: u64) -> Rep {
        Rep((kind as u64) << 48 | offset)
    }

    /// An array whose length and elements are at `offset`; 0 is the empty array.
    fn array(kind: Type, offset: u64) -> Rep {
        Rep(Rep::ARRAY | Rep::at(kind, offset).0)
    }

    fn is(self, flag: u64) -> bool {
        self.0 & flag != 0
    }

    fn payload(self) -> u64 {
        self.0 & Rep::PAYLOAD
    }

    /// The type, or its code if it is not one of [`Type`].
    fn kind(self) -> Result<Type, u8> {
        let code = (self.0 >> 48) as u8;
        Type::from_code(code).ok_or(code)
    }
}

/// Kinds of specs that are used here.
mod spec {
    pub(super) const ATTRIBUTE: u32 = 1;
    pub(super) const PRIM: u32 = 6;
    pub(super) const ROOT: u32 = 7;
}

/// First bytes of a file: the mark, three bytes of version, five of zero; then the offset of the table of sections.
const MAGIC: &[u8; 8] = b"PXR-USDC";
/// Bytes before the first value.
const BOOTSTRAP: u64 = 88;
/// Ends a set of fields.
const END_OF_SET: u32 = u32::MAX;
