// Sources of outputs: a sign and words for each.

export const SOURCES = {
  direct: { sign: "→", words: "direct" },
  reconstructed: { sign: "⊕", words: "reconstructed" },
  held: { sign: "‖", words: "held" },
  "fail-safe": { sign: "■", words: "fail-safe" },
  unknown: { sign: "?", words: "not known" },
};
