"""What tables are measured on: stations, boards and rooms that are arranged for one question."""
