//! Columns of `f32`: positions, normals, texture coordinates, colours. Every bit is kept.
//!
//! Each element of 1 to 4 numbers becomes as many integers, or 2 for unit vectors, and of them the
//! differences to a prediction are stored.

use super::{
    super::{
        grid::{self, EXPONENTS},
        octahedral::{self, FINE_NORMAL_BITS, MAX_BITS, NORMAL_BITS},
    },
    fault::Decoded,
    ints::Ints,
};
use serde::{Deserialize, Serialize};

/// What the integers mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Form {
    /// Bits of the numbers.
    Bits,
    /// Multiples of 2^exponent.
    Grid {
        /// The exponent.
        exponent: i16,
    },
    /// Unit vectors of 3 numbers as two octahedral codes.
    Octahedral {
        /// Bits of each code.
        bits: u8,
    },
}

impl Form {
    /// The form of any numbers that keeps every bit.
    pub(super) fn of_numbers<'a>(mut numbers: impl Iterator<Item = &'a [f32]>) -> Self {
        match grid::exponent_of(numbers.by_ref().flatten().copied()) {
            Some(exponent) => Self::Grid { exponent },
            None => Self::Bits,
        }
    }

    /// The form of vectors that keeps every bit.
    pub(super) fn of_vectors(vectors: impl Iterator<Item = [f32; 3]> + Clone) -> Self {
        let survives = |bits: u8| {
            vectors.clone().all(|vector| {
                let decoded = octahedral::decode(octahedral::encode(vector, bits), bits);
                decoded.map(f32::to_bits) == vector.map(f32::to_bits)
            })
        };
        if let Some(bits) = [NORMAL_BITS, FINE_NORMAL_BITS].into_iter().find(|&bits| survives(bits)) {
            return Self::Octahedral { bits };
        }
        match grid::exponent_of(vectors.flatten()) {
            Some(exponent) => Self::Grid { exponent },
            None => Self::Bits,
        }
    }

    /// Integers per element of `width` numbers.
    fn columns(self, width: usize) -> usize {
        if matches!(self, Self::Octahedral { .. }) { 2 } else { width }
    }

    fn check(self, width: usize) -> Decoded<()> {
        let is_sound = match self {
            Self::Bits => true,
            Self::Grid { exponent } => EXPONENTS.contains(&exponent),
            Self::Octahedral { bits } => width == 3 && (2..=MAX_BITS).contains(&bits),
        };
        if is_sound { Ok(()) } else { Err(format!("numbers in the form {self:?}")) }
    }

    /// Integers of an element; those beyond its columns are unused.
    #[inline]
    fn codes(self, [x, y, z, w]: [f32; 4]) -> [u32; 4] {
        match self {
            Self::Bits => [x, y, z, w].map(f32::to_bits),
            Self::Grid { exponent } => [x, y, z, w].map(|number| grid::code(number, exponent) as u32),
            Self::Octahedral { bits } => {
                let [u, v] = octahedral::encode([x, y, z], bits);
                [u as u32, v as u32, 0, 0]
            }
        }
    }

    #[inline]
    fn predicted(self, prediction: Option<[f32; 4]>) -> [u32; 4] {
        prediction.map_or([0; 4], |prediction| self.codes(prediction))
    }

    #[inline]
    fn numbers(self, codes: [u32; 4]) -> [f32; 4] {
        match self {
            Self::Bits => codes.map(f32::from_bits),
            Self::Grid { exponent } => codes.map(|code| grid::value(code as i32, exponent)),
            Self::Octahedral { bits } => {
                let [x, y, z] = octahedral::decode([codes[0] as i32, codes[1] as i32], bits);
                [x, y, z, 0.0]
            }
        }
    }
}

/// Elements of a few numbers each.
#[derive(Serialize, Deserialize)]
pub(super) struct Numbers<'a> {
    form: Form,
    #[serde(borrow)]
    columns: Vec<Ints<'a>>,
}

impl Numbers<'_> {
    /// Encodes `count` elements of `width` numbers; `element` gives an element and its prediction.
    pub(super) fn encode(
        form: Form,
        [count, width]: [usize; 2],
        element: impl Fn(usize) -> ([f32; 4], Option<[f32; 4]>),
    ) -> Numbers<'static> {
        let mut columns = vec![Vec::with_capacity(count); form.columns(width)];
        for i in 0..count {
            let (numbers, predicted) = element(i);
            let (codes, predicted) = (form.codes(numbers), form.predicted(predicted));
            for (column, values) in columns.iter_mut().enumerate() {
                values.push(codes[column].wrapping_sub(predicted[column]));
            }
        }
        Numbers { form, columns: Ints::encode_all(&columns) }
    }

    /// Decodes `count` elements of `width` numbers. Allocates up to 20 bytes for each.
    pub(super) fn decode(&self, [count, width]: [usize; 2]) -> Decoded<Codes> {
        self.form.check(width)?;
        if self.columns.len() != self.form.columns(width) {
            return Err(format!("{} columns for {width} numbers", self.columns.len()));
        }
        let columns = self.columns.iter().map(|column| column.decode(count)).collect::<Decoded<Vec<_>>>()?;
        Ok(Codes { form: self.form, columns })
    }
}

/// Decoded integers, still without their predictions.
pub(super) struct Codes {
    form: Form,
    columns: Vec<Vec<u32>>,
}

impl Codes {
    /// Element `i`, given its prediction if it has one.
    #[inline]
    pub(super) fn element(&self, i: usize, predicted: Option<[f32; 4]>) -> [f32; 4] {
        self.element_by(self.form, i, predicted)
    }

    /// Calls `put` with every element; `predicted` predicts it.
    pub(super) fn each(
        &self,
        count: usize,
        predicted: impl Fn(usize) -> Option<[f32; 4]>,
        mut put: impl FnMut(usize, [f32; 4]),
    ) {
        // One loop for each form, so that none decides it for every element.
        match self.form {
            Form::Bits => (0..count).for_each(|i| put(i, self.element_by(Form::Bits, i, predicted(i)))),
            Form::Grid { exponent } => {
                (0..count).for_each(|i| put(i, self.element_by(Form::Grid { exponent }, i, predicted(i))));
            }
            Form::Octahedral { bits } => {
                (0..count).for_each(|i| put(i, self.element_by(Form::Octahedral { bits }, i, predicted(i))));
            }
        }
    }

    #[inline(always)]
    fn element_by(&self, form: Form, i: usize, predicted: Option<[f32; 4]>) -> [f32; 4] {
        let mut codes = form.predicted(predicted);
        for (code, column) in codes.iter_mut().zip(&self.columns) {
            *code = code.wrapping_add(column[i]);
        }
        form.numbers(codes)
    }
}

/// Three numbers and a 0.
pub(super) fn padded([x, y, z]: [f32; 3]) -> [f32; 4] {
    [x, y, z, 0.0]
}
