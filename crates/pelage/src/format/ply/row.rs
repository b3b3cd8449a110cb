//! One row of an element as the PLY parser fills it.

use ply_rs::ply::{PropertyAccess, PropertyAccessResult};

/// Values of one row by slot: scalars in slots '0' to '9' (exact in `f64`), a list of indices in slot 'i', a list of
/// reals in slot 't'. Everything else is ignored.
#[derive(Debug)]
pub(super) struct Row<const N: usize> {
    /// Scalars of slots '0', '1', ...
    pub value: [f64; N],
    /// List of slot 'i'. A negative index arrives as 2^32 less its size.
    pub index: Vec<u32>,
    /// List of slot 't'.
    pub real: Vec<f32>,
}

impl<const N: usize> Row<N> {
    fn scalar(&mut self, slot: &str, value: f64) -> PropertyAccessResult {
        let k = slot.as_bytes()[0].wrapping_sub(b'0');
        match self.value.get_mut(usize::from(k)) {
            Some(v) => {
                *v = value;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::Ignored,
        }
    }

    fn integers<T: Copy>(
        &mut self,
        slot: &str,
        list: Vec<T>,
        index: fn(T) -> u32,
        real: fn(T) -> f32,
    ) -> PropertyAccessResult {
        match slot.as_bytes()[0] {
            b'i' => self.index = list.into_iter().map(index).collect(),
            b't' => self.real = list.into_iter().map(real).collect(),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }

    fn reals<T: Copy>(&mut self, slot: &str, list: Vec<T>, real: fn(T) -> f32) -> PropertyAccessResult {
        match slot.as_bytes()[0] {
            b'i' => return PropertyAccessResult::UnsupportedType,
            b't' => self.real = list.into_iter().map(real).collect(),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

impl<const N: usize> PropertyAccess for Row<N> {
    fn new() -> Self {
        Row { value: [0.0; N], index: Vec::new(), real: Vec::new() }
    }

    fn set_char(&mut self, slot: &str, v: i8) -> PropertyAccessResult {
        self.scalar(slot, f64::from(v))
    }

    fn set_uchar(&mut self, slot: &str, v: u8) -> PropertyAccessResult {
        self.scalar(slot, f64::from(v))
    }

    fn set_short(&mut self, slot: &str, v: i16) -> PropertyAccessResult {
        self.scalar(slot, f64::from(v))
    }

    fn set_ushort(&mut self, slot: &str, v: u16) -> PropertyAccessResult {
        self.scalar(slot, f64::from(v))
    }

    fn set_int(&mut self, slot: &str, v: i32) -> PropertyAccessResult {
        self.scalar(slot, f64::from(v))
    }

    fn set_uint(&mut self, slot: &str, v: u32) -> PropertyAccessResult {
        self.scalar(slot, f64::from(v))
    }

    fn set_float(&mut self, slot: &str, v: f32) -> PropertyAccessResult {
        self.scalar(slot, f64::from(v))
    }

    fn set_double(&mut self, slot: &str, v: f64) -> PropertyAccessResult {
        self.scalar(slot, v)
    }

    fn set_list_char(&mut self, slot: &str, v: Vec<i8>) -> PropertyAccessResult {
        self.integers(slot, v, |x| i32::from(x) as u32, f32::from)
    }

    fn set_list_uchar(&mut self, slot: &str, v: Vec<u8>) -> PropertyAccessResult {
        self.integers(slot, v, u32::from, f32::from)
    }

    fn set_list_short(&mut self, slot: &str, v: Vec<i16>) -> PropertyAccessResult {
        self.integers(slot, v, |x| i32::from(x) as u32, f32::from)
    }

    fn set_list_ushort(&mut self, slot: &str, v: Vec<u16>) -> PropertyAccessResult {
        self.integers(slot, v, u32::from, f32::from)
    }

    fn set_list_int(&mut self, slot: &str, v: Vec<i32>) -> PropertyAccessResult {
        self.integers(slot, v, |x| x as u32, |x| x as f32)
    }

    fn set_list_uint(&mut self, slot: &str, v: Vec<u32>) -> PropertyAccessResult {
        self.integers(slot, v, |x| x, |x| x as f32)
    }

    fn set_list_float(&mut self, slot: &str, v: Vec<f32>) -> PropertyAccessResult {
        self.reals(slot, v, |x| x)
    }

    fn set_list_double(&mut self, slot: &str, v: Vec<f64>) -> PropertyAccessResult {
        self.reals(slot, v, |x| x as f32)
    }
}
