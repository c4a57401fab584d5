// Colours that people with any colour vision tell apart (Okabe and Ito), one a person.
export const COLOURS = [0x56b4e9, 0xe69f00, 0x3ed6a0, 0xcc79a7, 0xf0c733, 0xff9a62];

/** A person's colour as `#rrggbb`, by their number. */
export const colourOf = (index) =>
  `#${COLOURS[index % COLOURS.length].toString(16).padStart(6, "0")}`;
