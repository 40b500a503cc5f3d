//! Material libraries of OBJ files: the statements that foliage needs, and nothing that can fail.

/// A material as its library states it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Statement {
    pub(super) name: String,
    /// Colour, of a material without a texture.
    pub(super) diffuse: Option<[f32; 3]>,
    /// The words of a colour that are not numbers; empty if there are none.
    pub(super) not_a_color: Box<str>,
    /// Colour texture, `map_Kd`.
    pub(super) color: Option<Box<Map>>,
    /// Opacity texture, `map_d` or `map_opacity`.
    pub(super) opacity: Option<Box<Map>>,
}

/// A texture and the options in front of its name.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Map {
    pub(super) file: String,
    /// Texture coordinates are multiplied by this, then `offset` is added; v points up.
    pub(super) scale: [f32; 2],
    pub(super) offset: [f32; 2],
    /// Whether the texture does not repeat.
    pub(super) clamp: bool,
    /// Channel that an opacity is read from; by default alpha, or luminance where alpha is whole.
    pub(super) channel: Option<Channel>,
    /// Options that change the picture and are not supported.
    pub(super) ignored: Vec<String>,
}

/// A channel of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Channel {
    Red,
    Green,
    Blue,
    Alpha,
    Luminance,
}

/// The materials of a library, in order.
pub(super) fn parse(library: &str) -> Vec<Statement> {
    let mut statements: Vec<Statement> = Vec::new();
    for line in library.lines().map(str::trim) {
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        if key.eq_ignore_ascii_case("newmtl") {
            statements.push(Statement { name: rest.to_owned(), ..Statement::default() });
        }
        let Some(statement) = statements.last_mut() else { continue };
        match key.to_ascii_lowercase().as_str() {
            "kd" => {
                statement.diffuse = color(rest);
                let is_read = rest.split_whitespace().all(|word| word.parse::<f32>().is_ok());
                statement.not_a_color = if is_read { "" } else { rest }.into();
            }
            "map_kd" => statement.color = map(rest).map(Box::new),
            "map_d" | "map_opacity" => statement.opacity = map(rest).map(Box::new),
            _ => {}
        }
    }
    statements
}

/// Three numbers, or one for a grey.
fn color(rest: &str) -> Option<[f32; 3]> {
    let numbers: Option<Vec<f32>> = rest.split_whitespace().take(3).map(|word| word.parse().ok()).collect();
    match numbers?[..] {
        [grey] => Some([grey; 3]),
        [red, green, blue] => Some([red, green, blue]),
        _ => None,
    }
}

/// Minimum and maximum number of arguments of each option.
const OPTIONS: [(&str, [usize; 2]); 13] = [
    ("-blendu", [1, 1]),
    ("-blendv", [1, 1]),
    ("-bm", [1, 1]),
    ("-boost", [1, 1]),
    ("-cc", [1, 1]),
    ("-clamp", [1, 1]),
    ("-imfchan", [1, 1]),
    ("-mm", [2, 2]),
    ("-o", [1, 3]),
    ("-s", [1, 3]),
    ("-t", [1, 3]),
    ("-texres", [1, 1]),
    ("-type", [1, 1]),
];

/// The texture of a statement: options, then a name, which may contain spaces.
fn map(mut rest: &str) -> Option<Map> {
    let mut map = Map {
        file: String::new(),
        scale: [1.0; 2],
        offset: [0.0; 2],
        clamp: false,
        channel: None,
        ignored: Vec::new(),
    };
    while let Some((option, after)) = rest.split_once(char::is_whitespace) {
        let Some((_, [least, most])) = OPTIONS.iter().find(|(known, _)| known.eq_ignore_ascii_case(option)) else {
            break;
        };
        let (arguments, after) = arguments(after.trim_start(), *least, *most);
        map.apply(&option.to_ascii_lowercase(), &arguments);
        rest = after;
    }
    map.file = rest.trim_matches('"').to_owned();
    (!map.file.is_empty()).then_some(map)
}

/// The first words of `rest`, at least `least` and, as long as they are numbers, up to `most`; and
/// the text after them. The last word is always left.
fn arguments(mut rest: &str, least: usize, most: usize) -> (Vec<&str>, &str) {
    let mut arguments = Vec::new();
    while let Some((word, after)) = rest.split_once(char::is_whitespace) {
        let is_argument = arguments.len() < least || word.parse::<f32>().is_ok();
        if arguments.len() == most || !is_argument {
            break;
        }
        arguments.push(word);
        rest = after.trim_start();
    }
    (arguments, rest)
}

impl Map {
    fn apply(&mut self, option: &str, arguments: &[&str]) {
        let numbers: Vec<f32> = arguments.iter().filter_map(|word| word.parse().ok()).collect();
        let numbers = if numbers.iter().all(|number| number.is_finite()) { &numbers[..] } else { &[] };
        match (option, numbers) {
            ("-s", [u]) => self.scale = [*u, 1.0],
            ("-s", [u, v, ..]) => self.scale = [*u, *v],
            ("-o", [u]) => self.offset = [*u, 0.0],
            ("-o", [u, v, ..]) => self.offset = [*u, *v],
            ("-clamp", _) => self.clamp = arguments.iter().any(|word| word.eq_ignore_ascii_case("on")),
            ("-imfchan", _) => self.channel = arguments.first().and_then(|word| channel(word)),
            ("-mm", [0.0, 1.0]) => {}
            ("-t", numbers) if numbers.iter().all(|number| *number == 0.0) => {}
            ("-mm" | "-t" | "-s" | "-o", _) => self.ignored.push(format!("{option} {}", arguments.join(" "))),
            _ => {}
        }
    }

    /// Whether the texture lies on the surface as `other` does.
    pub(super) fn lies_as(&self, other: &Self) -> bool {
        (self.scale, self.offset, self.clamp) == (other.scale, other.offset, other.clamp)
    }
}

fn channel(word: &str) -> Option<Channel> {
    match word.to_ascii_lowercase().as_str() {
        "r" => Some(Channel::Red),
        "g" => Some(Channel::Green),
        "b" => Some(Channel::Blue),
        "m" => Some(Channel::Alpha),
        "l" => Some(Channel::Luminance),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(rest: &str) -> String {
        map(rest).map(|map| map.file).unwrap_or_default()
    }

    #[test]
    fn every_option_is_passed_over_with_its_arguments() {
        for options in [
            "-s 1 1 1",
            "-o 0.5 0",
            "-t 0",
            "-bm 0.3",
            "-clamp on",
            "-blendu on -blendv off",
            "-imfchan m",
            "-mm 0 1",
            "-texres 512 -type sphere -boost 2 -cc off",
        ] {
            assert_eq!(file(&format!("{options} my leaf.png")), "my leaf.png", "{options}");
        }
        assert_eq!(
            ["-leaf.png", "- a.png", "\"my leaf.png\"", "-s", "-o 1 2"].map(file),
            ["-leaf.png", "- a.png", "my leaf.png", "-s", "2"]
        );
    }

    #[test]
    fn places_and_channels_are_kept_and_the_rest_is_listed() {
        let map = map("-s 2 3 1 -o 0.5 -clamp on -imfchan g -mm 0.1 0.7 -t 0.2 0 0 a.png").unwrap();
        assert_eq!((map.scale, map.offset, map.clamp), ([2.0, 3.0], [0.5, 0.0], true));
        assert_eq!(
            (map.channel, &map.ignored[..]),
            (Some(Channel::Green), &["-mm 0.1 0.7", "-t 0.2 0 0"].map(String::from)[..])
        );
    }

    #[test]
    fn a_colour_has_three_numbers_or_one() {
        let diffuse = |kd: &str| parse(&format!("Kd 9\nnewmtl a\n{kd}\n"))[0].diffuse;
        assert_eq!(diffuse("Kd 0.5"), Some([0.5; 3]));
        assert_eq!(diffuse("  kd\t0.5 0 1"), Some([0.5, 0.0, 1.0]));
        assert_eq!([diffuse("Kd"), diffuse("Kd 1 2"), diffuse("Kd spectral a.rfl"), diffuse("")], [None; 4]);
    }
}
