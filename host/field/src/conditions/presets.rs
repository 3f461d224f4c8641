//! The presets: common fields, each a list of differences from the default.

/// The presets: a name, and a file that says what differs from the default.
pub(super) const PRESETS: &[(&str, &str)] = &[
    ("transplanted", ""),
    ("even-stand", include_str!("../../presets/even-stand.toml")),
    ("direct-sown", include_str!("../../presets/direct-sown.toml")),
    ("weedy", include_str!("../../presets/weedy.toml")),
    ("soft-ground", include_str!("../../presets/soft-ground.toml")),
    ("heavy-soil", include_str!("../../presets/heavy-soil.toml")),
    ("dusty", include_str!("../../presets/dusty.toml")),
    ("hand-steered", include_str!("../../presets/hand-steered.toml")),
    ("hand-steered-set-up", include_str!("../../presets/hand-steered-set-up.toml")),
    ("set-up", include_str!("../../presets/set-up.toml")),
    ("quick-tool", include_str!("../../presets/quick-tool.toml")),
    ("chilli", include_str!("../../presets/chilli.toml")),
    ("broccoli", include_str!("../../presets/broccoli.toml")),
    ("maize", include_str!("../../presets/maize.toml")),
    ("maize-uneven", include_str!("../../presets/maize-uneven.toml")),
    // The same field as the first, named by its machine.
    ("from-the-box", ""),
    ("paper", include_str!("../../presets/paper.toml")),
];

/// The presets' names.
pub fn presets() -> impl Iterator<Item = &'static str> {
    PRESETS.iter().map(|(preset, _)| *preset)
}
