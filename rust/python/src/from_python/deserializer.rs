//! What serde wants to read, read from a Python object.

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyByteArray, PyBytes, PyFloat, PyInt, PySequence, PyString};
use serde::de::{self, Visitor};

use super::access::{Fields, Items, Name, fields_of};
use super::error::{Error, one_of};

/// Deeper nesting is refused: a list may contain itself.
const DEEPEST: usize = 32;

/// One Python object; arrays and scalars of NumPy count as lists and numbers.
pub struct Deserializer<'py> {
    value: Bound<'py, PyAny>,
    depth: usize,
    /// Whether a number may be infinite.
    is_unbounded: bool,
}

impl<'py> Deserializer<'py> {
    pub fn new(value: &Bound<'py, PyAny>) -> Self {
        Self::within(value, 0)
    }

    /// Of an item, `depth` levels down.
    pub fn within(value: &Bound<'py, PyAny>, depth: usize) -> Self {
        let plain = value.hasattr("__array__").ok().filter(|is_array| *is_array);
        let plain = plain.and_then(|_| value.call_method0("tolist").ok());
        Self { value: plain.unwrap_or_else(|| value.clone()), depth: depth + 1, is_unbounded: false }
    }

    pub fn unbounded_if(self, is_unbounded: bool) -> Self {
        Self { is_unbounded, ..self }
    }

    fn text(&self, expected: &str) -> Result<String, Error> {
        let text = self.value.cast::<PyString>().map_err(|_| Error::new(expected))?;
        text.to_str().map(str::to_owned).map_err(|_| Error::new(expected))
    }

    fn is_integer(&self) -> bool {
        self.value.is_instance_of::<PyInt>() && !self.value.is_instance_of::<PyBool>()
    }

    /// An integer that fits.
    fn integer<T: for<'a> FromPyObject<'a, 'py>>(&self, expected: &str) -> Result<T, Error> {
        let integer = if self.is_integer() { self.value.extract().ok() } else { None };
        integer.ok_or_else(|| Error::new(expected))
    }

    fn number(&self) -> Result<f64, Error> {
        let is_number = self.value.is_instance_of::<PyFloat>() || self.is_integer();
        let number = if is_number { self.value.extract().ok() } else { None };
        let is_admissible = |number: &f64| number.is_finite() || self.is_unbounded && !number.is_nan();
        number
            .filter(is_admissible)
            .ok_or_else(|| Error::new(if self.is_unbounded { "a number" } else { "a finite number" }))
    }

    /// The items of a sequence other than text.
    fn items(&self, expected: &str) -> Result<Items<'py>, Error> {
        let is_text = self.value.is_instance_of::<PyString>()
            || self.value.is_instance_of::<PyBytes>()
            || self.value.is_instance_of::<PyByteArray>();
        let sequence = self.value.cast::<PySequence>().ok().filter(|_| !is_text && self.depth < DEEPEST);
        let items = sequence.and_then(|sequence| sequence.to_list().ok());
        let items: Vec<_> = items.ok_or_else(|| Error::new(expected))?.iter().collect();
        Ok(Items { items: items.into_iter().enumerate(), depth: self.depth, is_unbounded: self.is_unbounded })
    }

    /// The fields of a mapping, or of a dataclass if `takes` it.
    fn fields(&self, first: &[&str], expected: &str, section: Option<&str>) -> Result<Fields<'py>, Error> {
        let of_another = section.is_some_and(|section| section_of(&self.value).is_some_and(|other| other != section));
        let fields = if of_another || self.depth >= DEEPEST { None } else { fields_of(&self.value)? };
        fields
            .map(|fields| Fields::new(fields, first, self.depth, self.is_unbounded))
            .ok_or_else(|| Error::new(expected))
    }
}

/// Sections of the configuration with a class of their own: name in the core, name in messages, classes of `snake_env`.
const SECTIONS: [(&str, &str, &str); 11] = [
    ("RobotConfig", "robot", "Robot"),
    ("Motor", "motor", "Motor"),
    ("SceneConfig", "scene", "Scene"),
    ("Stribeck", "stribeck", "Stribeck"),
    ("Patch", "patch", "Patch"),
    ("GaitConfig", "gait", "Gait"),
    ("ControllerConfig", "controller", "PD, a snake_env.IOLinearizing"),
    ("IntegratorConfig", "integrator", "Integrator"),
    ("NoiseConfig", "noise", "Noise"),
    ("Randomization", "randomization", "Randomization"),
    ("StartConfig", "start", "Start"),
];

/// The section that an object of one of the package's classes is.
fn section_of(value: &Bound<'_, PyAny>) -> Option<String> {
    value.get_type().getattr("_section").ok()?.extract().ok()
}

impl<'de> de::Deserializer<'de> for Deserializer<'_> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        let value = &self.value;
        if value.is_none() {
            visitor.visit_unit()
        } else if value.is_instance_of::<PyBool>() {
            self.deserialize_bool(visitor)
        } else if self.is_integer() && value.extract::<i64>().is_ok() {
            self.deserialize_i64(visitor)
        } else if value.is_instance_of::<PyFloat>() || self.is_integer() {
            self.deserialize_f64(visitor)
        } else if value.is_instance_of::<PyString>() {
            self.deserialize_str(visitor)
        } else if let Ok(items) = self.items("a sequence") {
            visitor.visit_seq(items)
        } else if let Ok(fields) = self.fields(&[], "a mapping", None) {
            visitor.visit_map(fields)
        } else {
            // No configuration has bytes: the visitor says what it expects.
            visitor.visit_bytes(&[])
        }
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_bool(self.value.cast::<PyBool>().map_err(|_| Error::new("True or False"))?.is_true())
    }

    fn deserialize_i64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_i64(self.integer("an integer")?)
    }

    fn deserialize_u32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_u32(self.integer("an integer >= 0")?)
    }

    fn deserialize_u64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_u64(self.integer("an integer >= 0")?)
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_f64(self.number()?)
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_string(self.text("text")?)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        self.deserialize_str(visitor)
    }

    fn deserialize_identifier<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        self.deserialize_str(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        if self.value.is_none() { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_newtype_struct(Self { is_unbounded: name == "Unbounded", ..self })
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_seq(self.items("a sequence")?)
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, Error> {
        let expected = format!("{length} numbers");
        let items = self.items(&expected)?;
        if items.items.len() == length { visitor.visit_seq(items) } else { Err(Error::new(expected)) }
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_map(self.fields(&[], "a mapping of field names to values", None)?)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        let section = SECTIONS.iter().find(|(of_core, ..)| *of_core == name);
        let mapping = "a mapping of field names to values";
        let expected = section.map(|(_, _, class)| format!("a snake_env.{class}, or {mapping}"));
        let expected = expected.unwrap_or_else(|| mapping.to_owned());
        let read = visitor.visit_map(self.fields(fields, &expected, section.map(|(_, section, _)| *section))?);
        read.map_err(|error| match error.unvalued_field().and_then(|field| field_of(&self.value, field)) {
            Some(item) => error.at(&item),
            None => error,
        })
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        names: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_enum(Name(&self.text(&one_of(names))?))
    }

    serde::forward_to_deserialize_any! {
        i8 i16 i32 i128 u8 u16 u128 f32 char bytes byte_buf unit unit_struct tuple_struct ignored_any
    }
}

/// The value of a field of a mapping or a dataclass.
pub fn field_of<'py>(value: &Bound<'py, PyAny>, field: &str) -> Option<Bound<'py, PyAny>> {
    let fields = fields_of(value).ok()??;
    fields.into_iter().find(|(name, _)| name == field).map(|(_, value)| value)
}
