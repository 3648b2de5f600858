//! What may be typed, as a JSON Schema: editors complete and check configurations with it, and the manual is made of it.

use super::file::ConfigFile;
use schemars::generate::SchemaSettings;
use serde_json::{Value, json};

/// The JSON Schema (draft 2020-12) of a configuration, made of the structs of [`super::file`] and their doc comments. It
/// knows keys, types and words; what values make sense together only `mpm-petsc check` can tell.
pub fn schema() -> Value {
    let mut schema = SchemaSettings::draft2020_12()
        .into_generator()
        .into_root_schema_for::<ConfigFile>();
    schema.insert("title".to_owned(), "Configuration of mpm-petsc".into());
    let mut schema = schema.to_value();
    // What a run needs, and what `mpm-petsc point` needs.
    let for_a_run = schema["required"].take();
    schema["anyOf"] = json!([{ "required": for_a_run }, { "required": ["materials", "path"] }]);
    schema["required"] = json!(["materials"]);
    schema
}
