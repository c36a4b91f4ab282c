//! stub
use super::results::ProblemResult;
pub fn draw(_p: &ProblemResult) -> Result<String, std::fmt::Error> {
    Ok(String::new())
}
