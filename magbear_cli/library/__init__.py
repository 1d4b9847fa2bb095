"""What a Python program does with magbear: the same studies, designs and results as the command's, as objects."""
