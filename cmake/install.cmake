# placeholder: filled by the install step
