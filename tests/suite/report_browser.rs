//! Reports as a browser shows them: measured in headless Chromium at desktop and phone width.
//!
//! Requires `chromium`; without it each test reports that it was skipped, unless
//! `PLIANT_BROWSER_TESTS=required`.

use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

/// Widths of a desktop window and of a phone [CSS pixels].
const WIDTHS: [u32; 2] = [1300, 390];

/// Height of the first screen at these widths [CSS pixels].
const HEIGHTS: [u32; 2] = [900, 844];

/// Names under which Chromium is installed.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// Measures a page in a frame, folded and with all details open, and leaves the result as JSON.
/// The result stands between `<<` and `>>` in the printed document.
const MEASURE: &str = r"
const frame = document.querySelector('iframe');
frame.onload = () => {
  const view = frame.contentWindow, page = frame.contentDocument, html = page.documentElement;
  const width = view.innerWidth, height = view.innerHeight;
  const shown = element => {
    const box = element.getBoundingClientRect();
    return box.width > 0 && box.height > 0 && box.left >= -0.5 && box.right <= width + 0.5;
  };
  // In a card, a cell repeats its column's header.
  const labeled = cell => cell.closest('thead') && view.getComputedStyle(cell.closest('thead')).display == 'none'
    && [...cell.closest('table').querySelectorAll('tbody td')].filter(other => other.cellIndex == cell.cellIndex)
      .every(other => view.getComputedStyle(other, '::before').content.includes(cell.innerText));
  const result = { width, closed: html.scrollWidth, dark: view.matchMedia('(prefers-color-scheme: dark)').matches };
  const verdict = page.querySelector('.verdict').getBoundingClientRect();
  result.verdict = verdict.top >= 0 && verdict.bottom <= height && shown(page.querySelector('.verdict strong'));
  result.first = page.body.innerText.split('\n').filter(line => line.trim()).slice(0, 2);
  const picture = page.querySelector('.multiples svg, .map .cells i');
  result.picture = shown(picture) && picture.getBoundingClientRect().top < height;
  result.folded = [...page.querySelectorAll('details:not([open])')].length;
  page.querySelectorAll('details').forEach(details => details.open = true);
  result.open = html.scrollWidth;
  const tables = [...page.querySelectorAll('table')];
  result.tables = tables.length;
  result.hidden = tables.flatMap(table => [...table.querySelectorAll('th, td')])
    .filter(cell => cell.innerText.trim() && !shown(cell) && !labeled(cell)).map(cell => cell.innerText).slice(0, 5);
  result.columns = [...tables[0].querySelectorAll('th')].filter(shown).length;
  result.clipped = tables.flatMap(table => [...table.querySelectorAll('td')])
    .filter(cell => cell.scrollWidth > cell.clientWidth + 1).map(cell => cell.innerText).slice(0, 5);
  const sticky = view.getComputedStyle(tables[0].querySelector('th')).position;
  result.sticky = sticky;
  result.small = [...page.querySelectorAll('.multiples svg text')]
    .filter(text => text.getBoundingClientRect().height < 9).length;
  result.text = page.body.innerText;
  const cell = page.querySelector('.map .cells i');
  if (cell) {
    cell.focus();
    const style = view.getComputedStyle(cell, '::after');
    result.about = style.content;
    result.aboutPlace = style.position;
  }
  const code = document.createElement('pre');
  code.textContent = '<<' + encodeURIComponent(JSON.stringify(result)) + '>>';
  document.body.append(code);
};
frame.srcdoc = decodeURIComponent(document.getElementById('page').textContent);
";

fn chromium() -> Option<&'static str> {
    static FOUND: OnceLock<Option<&'static str>> = OnceLock::new();
    *FOUND.get_or_init(|| {
        let runs = |name: &&str| Command::new(name).arg("--version").output().is_ok();
        let found = NAMES.into_iter().find(|name| runs(name));
        let required = std::env::var("PLIANT_BROWSER_TESTS").is_ok_and(|value| value == "required");
        assert!(
            found.is_some() || !required,
            "browser tests are required, but none of {NAMES:?} is installed"
        );
        if found.is_none() {
            println!("skipped: needs chromium");
        }
        found
    })
}

/// An empty folder for a test.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("pliant-browser-{}-{name}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder for temporary files");
    folder
}

fn pliant(folder: &Path, arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_pliant"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the program starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
}

/// What a browser shows of a page in a window of this width and height.
fn measured(
    browser: &str,
    folder: &Path,
    html: &str,
    width: u32,
    height: u32,
    dark: bool,
) -> Value {
    // A frame, as a window of a browser cannot be as narrow as a phone.
    let page = format!(
        "<!doctype html><meta charset=\"utf-8\"><title>measure</title>\
         <iframe width=\"{width}\" height=\"{height}\" style=\"border:0\"></iframe>\
         <script type=\"text/plain\" id=\"page\">{}</script><script>{MEASURE}</script>",
        percent_encoded(html),
    );
    let file = folder.join(format!("measure-{width}-{dark}.html"));
    fs::write(&file, page).expect("written");
    let mut command = Command::new(browser);
    command
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--disable-breakpad",
            "--window-size=1400,1000",
            "--virtual-time-budget=10000",
            "--dump-dom",
        ])
        .args(dark.then_some("--force-dark-mode"))
        .arg(format!(
            "--user-data-dir={}",
            folder.join("profile").display()
        ))
        .arg(format!("file://{}", file.display()));
    let output = command.output().expect("the browser starts");
    let text = String::from_utf8_lossy(&output.stdout);
    // As in the printed document: the script itself has the marks in quotes.
    let result = text
        .split("&lt;&lt;")
        .nth(1)
        .and_then(|rest| rest.split("&gt;&gt;").next());
    let said = String::from_utf8_lossy(&output.stderr);
    let result = result.unwrap_or_else(|| panic!("the page was not measured: {said}"));
    serde_json::from_str(&percent_decoded(result)).expect("a JSON object")
}

fn percent_encoded(text: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_. \n".contains(&byte);
    text.bytes()
        .map(|byte| match plain(byte) {
            true => char::from(byte).to_string(),
            false => format!("%{byte:02X}"),
        })
        .collect()
}

fn percent_decoded(text: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let code = (first == b'%').then(|| after.get(..2)).flatten();
        let code =
            code.and_then(|code| u8::from_str_radix(std::str::from_utf8(code).ok()?, 16).ok());
        match code {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            None => {
                bytes.push(first);
                rest = after;
            }
        }
    }
    String::from_utf8(bytes).expect("UTF-8")
}

/// Marks of Markdown that are left in the text of a page.
fn marks(text: &str) -> Vec<&str> {
    let is_marked = |line: &&str| {
        let start = line.trim_start();
        line.contains("**")
            || line.contains('`')
            || line.contains("](")
            || line.contains("| ---")
            || start.starts_with("# ")
            || start.starts_with("## ")
            || line.split_whitespace().any(|word| word.starts_with('*'))
    };
    text.lines().filter(is_marked).collect()
}

/// Checks a page in both widths, and returns what was measured.
fn checked(browser: &str, folder: &Path, html: &str) -> [Value; 2] {
    for outside in ["<script", "<link", "src=", "@import", "url("] {
        assert!(!html.contains(outside), "{outside} needs something else");
    }
    [0, 1].map(|place| {
        let width = WIDTHS[place];
        let seen = measured(browser, folder, html, width, HEIGHTS[place], place == 1);
        let about = |what: &str| {
            format!("{what} at {width}: {:#}", {
                let mut seen = seen.clone();
                seen["text"] = Value::Null;
                seen
            })
        };
        assert_eq!(seen["width"], width);
        assert_eq!(seen["dark"], place == 1);
        for state in ["closed", "open"] {
            let document = seen[state].as_u64().expect("a width");
            assert!(document <= u64::from(width), "{}", about("too wide"));
        }
        assert_eq!(seen["verdict"], true, "{}", about("the verdict is hidden"));
        assert_eq!(seen["picture"], true, "{}", about("no picture in sight"));
        assert_eq!(
            seen["hidden"],
            Value::Array(vec![]),
            "{}",
            about("hidden cells")
        );
        assert_eq!(
            seen["clipped"],
            Value::Array(vec![]),
            "{}",
            about("clipped cells")
        );
        assert_eq!(seen["small"], 0, "{}", about("labels too small to read"));
        let text = seen["text"].as_str().expect("text");
        assert_eq!(
            marks(text),
            Vec::<&str>::new(),
            "marks of Markdown at {width}"
        );
        seen
    })
}

#[test]
fn a_study_is_readable_on_a_desktop_and_on_a_phone() {
    let Some(browser) = chromium() else { return };
    let folder = folder("study");
    let problems = [
        "hanging_mass",
        "spring_energy",
        "cantilever_4",
        "chain_1e-3",
    ];
    let arguments = [&["study"], &problems[..], &["--quick", "--out", "out"]].concat();
    pliant(&folder, &arguments);
    let html = fs::read_to_string(folder.join("out/report.html")).expect("a report");
    let [wide, narrow] = checked(browser, &folder, &html);
    assert_eq!(html.matches("<figure><figcaption>").count(), problems.len());
    assert_eq!(wide["columns"], 9, "of the table of cheapest settings");
    assert_eq!(wide["sticky"], "sticky");
    assert!(wide["tables"].as_u64() > Some(5), "{}", wide["tables"]);
    assert_eq!(wide["first"], narrow["first"]);
    let verdict = wide["first"][1].as_str().expect("a line");
    assert!(
        verdict.contains("of 4 problems solved to 1\u{a0}%"),
        "{verdict}"
    );
    fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn a_torture_report_is_readable_on_a_desktop_and_on_a_phone() {
    let Some(browser) = chromium() else { return };
    let folder = folder("torture");
    pliant(
        &folder,
        &[
            "torture", "plates", "edge", "knot", "--quick", "--report", "out",
        ],
    );
    let html = fs::read_to_string(folder.join("out/report.html")).expect("a report");
    let [wide, narrow] = checked(browser, &folder, &html);
    assert_eq!(wide["columns"], 9, "of the table of worst members");
    assert_eq!(wide["sticky"], "sticky");
    assert_eq!(wide["folded"], 3, "nothing fails unexpectedly");
    for seen in [&wide, &narrow] {
        let verdict = seen["first"][1].as_str().expect("a line");
        assert!(
            verdict.contains("Passed: no unexpected failures"),
            "{verdict}"
        );
        let about = seen["about"].as_str().expect("text of the first cell");
        assert!(about.contains("edge 1: passed"), "{about}");
        assert_eq!(seen["aboutPlace"], "fixed");
    }
    fs::remove_dir_all(folder).expect("it was made here");
}

#[test]
fn a_page_that_is_too_wide_is_detected() {
    let Some(browser) = chromium() else { return };
    let folder = folder("wide");
    let page = |width: u32| {
        format!(
            "<!doctype html><p class=verdict><strong>V</strong></p><div class=multiples><svg></svg></div>\
             <table><tr><th>a<td>**b**</table><p style='width:{width}px'>*c*</p>"
        )
    };
    let narrow = measured(browser, &folder, &page(100), 390, 844, false);
    assert_eq!(narrow["closed"], 390);
    let wide = measured(browser, &folder, &page(700), 390, 844, false);
    assert!(wide["closed"].as_u64() > Some(700));
    assert_eq!(marks(wide["text"].as_str().expect("text")).len(), 2);
    fs::remove_dir_all(folder).expect("it was made here");
}
