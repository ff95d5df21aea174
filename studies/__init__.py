"""One file per question: each module's STUDY asks it and answers with tables, figures and runs."""
