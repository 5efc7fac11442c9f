import js from "@eslint/js";
import globals from "globals";
import ts from "typescript-eslint";

export default [
  js.configs.recommended,
  {
    languageOptions: { globals: { ...globals.browser, ...globals.node } },
    rules: {
      eqeqeq: "error",
      "max-len": ["error", { code: 100, ignoreStrings: true }],
      "no-var": "error",
      "prefer-const": ["error", { destructuring: "all" }],
      "no-restricted-syntax": [
        "error",
        {
          selector: "AssignmentExpression[left.property.name=/^(innerHTML|outerHTML)$/]",
          message: "Texts of a scene must never become markup.",
        },
      ],
    },
  },
  {
    files: ["**/*.ts"],
    languageOptions: { parser: ts.parser },
    // What tsc says better: it knows types from values.
    rules: { "no-undef": "off", "no-unused-vars": "off", "no-redeclare": "off" },
  },
];
