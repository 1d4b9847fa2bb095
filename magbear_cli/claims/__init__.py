"""What the thesis claims, judged by the numbers of results files: which claims hold, and why the others do not."""
