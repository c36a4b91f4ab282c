//! What was found, in words.
use super::{Study, document::Block, results::ProblemResult};
pub fn beginning(_study: &Study) -> Vec<Block> {
    vec![]
}
pub fn problem(_s: &Study, _p: &ProblemResult) -> Vec<Block> {
    vec![]
}
pub fn tables(_p: &ProblemResult) -> Vec<Block> {
    vec![]
}
pub fn end(_p: &Study) -> Vec<Block> {
    vec![]
}
pub fn caption(_p: &ProblemResult) -> String {
    String::new()
}
