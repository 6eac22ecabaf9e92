//! The items of Python's sequences and mappings.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping, PyString};
use serde::de::value::StrDeserializer;
use serde::de::{DeserializeSeed, EnumAccess, IntoDeserializer, MapAccess, SeqAccess, VariantAccess, Visitor};

use super::deserializer::Deserializer;
use super::error::Error;

/// The items of a sequence, in order.
pub struct Items<'py> {
    pub items: std::iter::Enumerate<std::vec::IntoIter<Bound<'py, PyAny>>>,
    /// Levels of nesting above.
    pub depth: usize,
    /// Whether numbers among them may be infinite.
    pub is_unbounded: bool,
}

impl<'de> SeqAccess<'de> for Items<'_> {
    type Error = Error;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Error> {
        let Some((index, item)) = self.items.next() else { return Ok(None) };
        let value = seed.deserialize(Deserializer::within(&item, self.depth).unbounded_if(self.is_unbounded));
        value.map(Some).map_err(|error| error.at(&item).inside(format!("[{index}]")))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.items.len())
    }
}

/// The fields of a mapping or a dataclass.
pub struct Fields<'py> {
    fields: std::vec::IntoIter<(String, Bound<'py, PyAny>)>,
    present: Option<(String, Bound<'py, PyAny>)>,
    depth: usize,
    is_unbounded: bool,
}

impl<'py> Fields<'py> {
    /// Those of `first` come first, in that order: the names of variants before what depends on them.
    pub fn new(mut fields: Vec<(String, Bound<'py, PyAny>)>, first: &[&str], depth: usize, is_unbounded: bool) -> Self {
        fields.sort_by_key(|(name, _)| first.iter().position(|one| one == name).unwrap_or(first.len()));
        Self { fields: fields.into_iter(), present: None, depth, is_unbounded }
    }
}

impl<'de> MapAccess<'de> for Fields<'_> {
    type Error = Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Error> {
        self.present = self.fields.next();
        let Some((name, value)) = &self.present else { return Ok(None) };
        let name: StrDeserializer<'_, Error> = name.as_str().into_deserializer();
        seed.deserialize(name).map(Some).map_err(|error| error.at(value))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Error> {
        let Some((name, value)) = self.present.take() else { return Err(Error::new("a value")) };
        let read = seed.deserialize(Deserializer::within(&value, self.depth).unbounded_if(self.is_unbounded));
        read.map_err(|error| error.at(&value).inside(format!(".{name}")))
    }
}

/// Names and values of an object's fields.
type NamedValues<'py> = Vec<(String, Bound<'py, PyAny>)>;

/// The fields of a mapping; `None` for another object.
///
/// # Errors
/// A key is not text, or the object cannot be read.
pub fn fields_of<'py>(value: &Bound<'py, PyAny>) -> Result<Option<NamedValues<'py>>, Error> {
    if let Some(names) = dataclass_fields(value) {
        return read_dataclass(value, &names).map(Some).map_err(|_| Error::new("an object whose fields can be read"));
    }
    let Ok(mapping) = value.cast::<PyMapping>() else { return Ok(None) };
    let items = mapping.items().map_err(|_| Error::new("a mapping that can be read"))?;
    let pairs = items.iter().map(|item| item.extract::<(Bound<'py, PyAny>, Bound<'py, PyAny>)>());
    let mut fields = Vec::with_capacity(items.len());
    for pair in pairs {
        let (key, value) = pair.map_err(|_| Error::new("a mapping that can be read"))?;
        let name = key.cast::<PyString>().map_err(|_| Error::new("a mapping of field names to values"))?;
        fields.push((name.to_string_lossy().into_owned(), value));
    }
    Ok(Some(fields))
}

/// `__dataclass_fields__` of an instance of a dataclass.
fn dataclass_fields<'py>(value: &Bound<'py, PyAny>) -> Option<Bound<'py, PyDict>> {
    let fields = value.get_type().getattr("__dataclass_fields__").ok()?;
    fields.cast_into::<PyDict>().ok()
}

/// A field that is None by default is left out where it is: the core's own default takes its place.
fn read_dataclass<'py>(value: &Bound<'py, PyAny>, fields: &Bound<'py, PyDict>) -> PyResult<NamedValues<'py>> {
    let mut read = Vec::with_capacity(fields.len());
    for (name, field) in fields {
        let item = value.getattr(name.cast::<PyString>()?)?;
        if !(item.is_none() && field.getattr("default")?.is_none()) && is_configuration(&field)? {
            read.push((name.extract()?, item));
        }
    }
    Ok(read)
}

/// Class variables and fields that only Python knows are none of the core's.
fn is_configuration(field: &Bound<'_, PyAny>) -> PyResult<bool> {
    let is_field = field.getattr("_field_type")?.getattr("name")?.extract::<String>()? == "_FIELD";
    Ok(is_field && !field.getattr("metadata")?.contains("python_only")?)
}

/// The name of a variant without data.
pub struct Name<'a>(pub &'a str);

impl<'de> EnumAccess<'de> for Name<'_> {
    type Error = Error;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), Error> {
        let name: StrDeserializer<'_, Error> = self.0.into_deserializer();
        Ok((seed.deserialize(name)?, self))
    }
}

impl<'de> VariantAccess<'de> for Name<'_> {
    type Error = Error;

    fn unit_variant(self) -> Result<(), Error> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, _: T) -> Result<T::Value, Error> {
        Err(Error::new("a name"))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, _: V) -> Result<V::Value, Error> {
        Err(Error::new("a name"))
    }

    fn struct_variant<V: Visitor<'de>>(self, _: &'static [&'static str], _: V) -> Result<V::Value, Error> {
        Err(Error::new("a name"))
    }
}
