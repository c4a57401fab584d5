"""Three days of use: what a designer, an operator, a tester and a stranger do, step by step."""
