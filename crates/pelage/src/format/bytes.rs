//! A bounds-checked little-endian cursor over bytes of a file that may be broken.

/// What is wrong with the bytes, in words; the caller adds the file and the place.
pub(super) type Broken = String;

/// Reads little-endian numbers from the front of a slice.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Bytes(bytes)
    }

    /// Bytes not yet read.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.0
    }

    /// The next `n` bytes.
    pub(super) fn take(&mut self, n: u64) -> Result<&'a [u8], Broken> {
        let n = usize::try_from(n).ok().filter(|&n| n <= self.0.len());
        let Some(n) = n else {
            return Err(format!("ends too early ({} bytes are left, more are announced)", self.0.len()));
        };
        let (head, tail) = self.0.split_at(n);
        self.0 = tail;
        Ok(head)
    }

    fn fixed<const N: usize>(&mut self) -> Result<[u8; N], Broken> {
        let mut out = [0; N];
        out.copy_from_slice(self.take(N as u64)?);
        Ok(out)
    }

    pub(super) fn u8(&mut self) -> Result<u8, Broken> {
        Ok(self.fixed::<1>()?[0])
    }

    pub(super) fn u16(&mut self) -> Result<u16, Broken> {
        Ok(u16::from_le_bytes(self.fixed()?))
    }

    pub(super) fn u32(&mut self) -> Result<u32, Broken> {
        Ok(u32::from_le_bytes(self.fixed()?))
    }

    pub(super) fn i32(&mut self) -> Result<i32, Broken> {
        Ok(i32::from_le_bytes(self.fixed()?))
    }

    pub(super) fn u64(&mut self) -> Result<u64, Broken> {
        Ok(u64::from_le_bytes(self.fixed()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_in_order_and_stops_at_the_end() {
        let mut b = Bytes::new(&[1, 2, 0, 3, 0, 0, 0, 9]);
        assert_eq!((b.u8(), b.u16(), b.u32()), (Ok(1), Ok(2), Ok(3)));
        assert!(b.u16().is_err() && b.take(u64::MAX).is_err());
        assert_eq!(b.rest(), &[9]);
    }
}
